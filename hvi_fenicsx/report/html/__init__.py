"""The page report.html, made from a finished folder alone."""
