"""Queue of rendering tasks of all pages: images first, then background tasks.

`scheduler` decides, `dispatcher` hands over, `coordinator` holds pages, session and rendering together.
"""
