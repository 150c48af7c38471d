"""Selections of parts of a field: by regions of the screen, by density, by attributes; and cages around them.

A field has *elements*: its splats, or the occupied cells of a grid over its density (`elements`). A selection
is a mask over them (`element_selection`), in canonical space: it stays when edits change.

Rule for edited scenes. An element is seen where the edits take it, at each of its deformed positions
(`element_positions`): a copy shows its elements twice, a delete nowhere. A region of the screen picks the
elements that have at least one position in it; so a brush on the copy of a thing selects the thing, and the
highlight shows both. Pasted content, and patches of uncovered regions, are no elements of the field.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
