"""Document of the editor and its editing operations, without web and rendering.

`session` has one method per command; `document` is the state that undo restores, `persistence` writes files.
"""
