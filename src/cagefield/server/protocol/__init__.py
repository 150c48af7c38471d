"""Message protocol between the editor's page and its server, and the conversion of messages to edits.

Messages are pydantic models; `schema` gives them all as one JSON schema, of which the page's types are made.
"""
