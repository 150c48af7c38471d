from .element_selection import Selection as Selection
from .elements import Elements as Elements
