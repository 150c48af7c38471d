"""Row layout of an edit stack in the shader of a page: rows of four float32 numbers (x, y, z, w).

Each edit has EDIT_ROWS rows, and the boxes [2,3] outside which nothing changes follow the rows of all edits.
Names with VECTOR are rows whose (x, y, z) hold a vector, the first row of several where a matrix or a box
follows; names with SCALAR are rows whose w holds a number. Offsets of a hexahedron count from its own first
row. The page's script has the same names, written by `npm run layout`.
"""

BOX_VECTOR = 0
"""Min and max [2,3] of the deformed-space box outside which the edit changes nothing."""

LATTICE_VECTOR = 2
"""Origin of the lattice, and from the next row on the matrix TO_NODES_VECTOR."""

TO_NODES_VECTOR = 3
"""Matrix [3,3] from world units to node units."""

NODE_BOX_VECTOR = 6
"""Min and max [2,3] of the outer cage in node units, where the cage is a parallelepiped."""

FIRST_SCALAR, LAST_SCALAR, RESOLUTION_SCALAR, CONTINUOUS_SCALAR = 0, 1, 2, 3
SIMPLE_SCALAR, UNDER_SCALAR, NODE_SCALAR, PART_SCALAR = 4, 5, 6, 7
"""As in `edits.device.packing`; NODE_SCALAR is the first node of the edit's lattice."""

HEXAHEDRON = 8
"""First row of the inner cage's hexahedron; the hexahedron of record 1 follows."""

MATRIX_VECTOR, CENTER_VECTOR, Y_BOX_VECTOR, BEND_VECTOR, IMAGE_VECTOR = 0, 3, 4, 6, 10
"""Rows of W [3,3], c, the box of y [2,3], the bend [4,3] and the image [8,3] of a hexahedron."""

AFFINE_SCALAR = 0
"""1 for an affine hexahedron."""

HEXAHEDRON_ROWS = 18

GRADE_SCALARS = 9
"""First row of the numbers of an edit's grade (`edits.grade`), in the w of rows that have a free one: number
k is that of row GRADE_SCALARS + k, from k = 17 on that of the row after. They are the matrix [3,3], the
factor of density plus 1 (0 where the edit does not grade), and of a continuous edit the frames of its
`GradeFalloff`, [4,3] of the inner and of the outer cage."""

GRADE_DENSITY, GRADE_INNER, GRADE_OUTER, GRADE_COUNT, GRADE_FIRST_PART = 9, 10, 22, 34, 17
"""Numbers of a grade: places of the density factor and of the frames, their count, and how many come before
the second hexahedron."""

EDIT_ROWS = HEXAHEDRON + 2 * HEXAHEDRON_ROWS
BOX_ROWS = 2

MAX_ROWS = 1024
"""Rows of the shader's 16 KiB of uniforms, which every WebGL2 has."""

NODES_PER_TEXTURE_ROW = 2048
"""Nodes in a row of the lattices' texture: every WebGL2 has textures of as many texels an edge."""
