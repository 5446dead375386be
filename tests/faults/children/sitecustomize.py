"""Python imports this at its start where its folder is on the path: processes that a test starts are recorded too."""

import line_recorder

line_recorder.record_child()
