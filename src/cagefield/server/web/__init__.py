"""The web server: the page, its socket, downloads, and who may have them. Only here is a web framework known.

`launch` goes from a scene's folder to a running editor.
"""
