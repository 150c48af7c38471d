"""What the editor's page and its server say to each other, and how that becomes edits and comes from them.

Messages are pydantic models; `schema` gives them all as one JSON schema, of which the page's types are made.
"""
