"""The document and its editing: what a user makes, and what may be made of it. Knows no web, no rendering.

`session` has one method per command; `document` is what undo goes back to, `persistence` what is saved.
"""
