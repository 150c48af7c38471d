"""The rendering process: it gets one task at a time over a pipe, and answers each with a result.

`tasks` is all that the two processes say to each other. Nothing here knows of pages or of what comes next.
"""
