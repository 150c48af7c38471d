from .camera import Camera as Camera
from .camera import turntable as turntable
from .camera_paths import CameraPath as CameraPath
from .camera_paths import load_camera_path as load_camera_path
from .camera_paths import orbit as orbit
from .keyframes import Keyframe as Keyframe
from .keyframes import stills as stills
