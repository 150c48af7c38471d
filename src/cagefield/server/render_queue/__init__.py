"""What the rendering process does next, and for which page: pictures first, then what can wait.

`scheduler` decides, `dispatcher` hands over, `coordinator` holds pages, session and rendering together.
"""
