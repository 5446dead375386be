"""``hvi study``: a scene solved along several axes, each solution compared with a reference: what accuracy costs."""
