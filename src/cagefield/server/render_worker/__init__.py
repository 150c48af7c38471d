"""The rendering process: it gets one task at a time over a pipe, and answers each with a result.

`tasks` has all messages between the two processes. Nothing here knows pages or the queue.
"""
