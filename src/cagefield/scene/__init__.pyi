from .alignment import Alignment as Alignment
from .hotspot_tour import tour_cameras as tour_cameras
from .hotspot_tour import tour_keys as tour_keys
from .hotspots import Hotspot as Hotspot
from .hotspots import HotspotView as HotspotView
from .paste_alignment import align_paste as align_paste
from .scene import Scene as Scene
