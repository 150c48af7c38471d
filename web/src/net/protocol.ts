// Made by `npm run protocol` from what src/cagefield/server/protocol/schema.py collects; change that.

/**
 * @minItems 3
 * @maxItems 3
 */
export type Vec3 = [number, number, number];
/**
 * @minItems 8
 * @maxItems 8
 */
export type Corners = [Vec3, Vec3, Vec3, Vec3, Vec3, Vec3, Vec3, Vec3];
export type PageMessage =
  | CameraMessage
  | DisplayMessage
  | PresentedMessage
  | Drawing
  | DragExpected
  | DragBegin
  | DragMove
  | DragEnd
  | DragCancel
  | PlayBegin
  | Play
  | PlayEnd
  | Apply
  | SetCage
  | Place
  | PasteScene
  | FitInner
  | OuterMargin
  | Change
  | SceneChange
  | Command
  | Mirror
  | Reorder
  | GoTo
  | SaveAs
  | LoadEdits
  | Ask
  | SetPath
  | RenderJob
  | ExportSplats
  | ExportPage
  | CancelJob
  | SelectRegion
  | SelectRange
  | SelectFlood
  | SelectFloaters
  | ChangeSelection
  | SelectionCage
  | Isolate
  | RemoveElements
  | PlacePoint
  | Subdivide
  | PointReach
  | PlaceMesh
  | PutHotspot
  | MoveHotspot
  | TourPath
  | ScaleChange
  | UpChange
  | AlignPaste;
export type ServerMessage = Hello | State | Dragged | DragOver | Answer | Notice | Preview | Preparing | Job;

/**
 * Replace the operations of a paste by the similarity that pairs of points give.
 *
 * `refine` brings its surfaces nearer to the scene's, `keep_scale` leaves the scale of the pairs in that;
 * `match_colors` replaces its grade.
 */
export interface AlignPaste {
  type: "align_paste";
  edit: number;
  pairs: PointPair[];
  refine?: boolean;
  keep_scale?: boolean;
  match_colors?: boolean;
}
/**
 * A point of pasted content where it stands, and the scene's point where it belongs: deformed space.
 */
export interface PointPair {
  pasted: Vec3;
  scene: Vec3;
}
/**
 * A whole operation at once, from numeric fields.
 */
export interface Apply {
  type: "apply";
  edit: number;
  target: "field" | "inner" | "outer" | "both";
  operation:
    | TranslateBy
    | RotateBy
    | ScaleBy
    | ShearBy
    | MoveCornersBy
    | MovePointBy
    | MovePointsBy
    | BendBy
    | TwistBy
    | TaperBy
    | MirrorBy;
}
/**
 * Move the cage.
 */
export interface TranslateBy {
  kind: "translate";
  by: Vec3;
}
/**
 * Turn the cage about its pivot by R_x R_y R_z, intrinsic XYZ, in degrees.
 */
export interface RotateBy {
  kind: "rotate";
  rotation_deg: Vec3;
  axes?: "world" | "cage";
}
/**
 * Scale the cage about its pivot; factors above 0.
 */
export interface ScaleBy {
  kind: "scale";
  by: Vec3;
  axes?: "world" | "cage";
}
/**
 * Shear the cage about its pivot: xy adds xy * y to x, and so on.
 */
export interface ShearBy {
  kind: "shear";
  xy?: number;
  xz?: number;
  yx?: number;
  yz?: number;
  zx?: number;
  zy?: number;
  axes?: "world" | "cage";
}
/**
 * Move one corner, the two of an edge, the four of a face, or any others together.
 */
export interface MoveCornersBy {
  kind: "move_corners";
  corners: number[];
  by: Vec3;
}
/**
 * Move one control point.
 */
export interface MovePointBy {
  kind: "move_point";
  point: number;
  by: Vec3;
}
/**
 * Move control points together; those within a radius > 0 around them go along in part.
 */
export interface MovePointsBy {
  kind: "move_points";
  points: number[];
  by: Vec3;
  radius?: number;
  falloff?: "smooth" | "sphere" | "root" | "sharp" | "linear";
}
/**
 * Bend a lattice along an axis of its own, `towards` another ("": the next); see `operations.Bend`.
 */
export interface BendBy {
  kind: "bend";
  axis: "x" | "y" | "z";
  degrees: number;
  towards?: ("x" | "y" | "z") | "";
  fixed?: "start" | "middle" | "end";
}
/**
 * Twist a lattice about an axis of its own.
 */
export interface TwistBy {
  kind: "twist";
  axis: "x" | "y" | "z";
  degrees: number;
  fixed?: "start" | "middle" | "end";
}
/**
 * Scale a lattice across an axis of its own, evenly to a factor at its end.
 */
export interface TaperBy {
  kind: "taper";
  axis: "x" | "y" | "z";
  factor: number;
  fixed?: "start" | "middle" | "end";
}
/**
 * Reflect the content of a move, a copy or a paste along an axis of its cage.
 */
export interface MirrorBy {
  kind: "mirror";
  axis: "x" | "y" | "z";
}
/**
 * A question: "surface" at a pixel (for focus), "edit_text" of an edit (for copying), its "grid"; "path".
 *
 * The "path" is the camera path between its keyframes, as its video goes; "sources" are the scenes and files
 * that can be pasted; a "histogram" is of an `attribute` of the field's elements.
 */
export interface Ask {
  type: "ask";
  request: number;
  what: "surface" | "edit_text" | "grid" | "path" | "sources" | "histogram";
  x?: number;
  y?: number;
  edit?: number | null;
  attribute?: "size" | "opacity" | "red" | "green" | "blue" | "hue" | "saturation" | "value";
}
/**
 * Camera of the page; `moving` while the mouse turns the view.
 */
export interface CameraMessage {
  type: "camera";
  seq: number;
  c2w: number[];
  width: number;
  height: number;
  fov_y_deg: number;
  moving: boolean;
}
/**
 * Stop a job and remove its unfinished file.
 */
export interface CancelJob {
  type: "cancel_job";
  job: number;
}
/**
 * Change an edit's options; omitted options stay.
 */
export interface Change {
  type: "change";
  edit: number;
  name?: string | null;
  enabled?: boolean | null;
  locked?: boolean | null;
  kind?: ("continuous" | "move" | "copy" | "delete") | null;
  shell?: ("flow" | "trilinear") | null;
  falloff?: ("smooth" | "linear") | null;
  width?: number | null;
  fill?: ("surroundings" | "none") | null;
  relight?: ("occlusion" | "shadow" | "none") | null;
  /**
   * 0: exact
   */
  lattice?: number | null;
  /**
   * the edit that carries this one; 0: none
   */
  parent?: number | null;
  grade?: GradeValues | null;
}
/**
 * All values of an edit's `Grade`.
 */
export interface GradeValues {
  exposure: number;
  temperature: number;
  tint: number;
  saturation: number;
  hue_deg: number;
  opacity: number;
}
/**
 * Selects all or none, inverts the selection, or grows or shrinks it by a cell.
 */
export interface ChangeSelection {
  type: "change_selection";
  change: "all" | "none" | "invert" | "grow" | "shrink";
}
/**
 * Command with an edit's number as its only argument.
 */
export interface Command {
  type: "command";
  name:
    | "undo"
    | "redo"
    | "save"
    | "duplicate"
    | "remove"
    | "select"
    | "reset_operations"
    | "remove_last_operation";
  edit?: number | null;
}
/**
 * Display of a view; `before` leaves the edits out, `split` left of a share of the width.
 */
export interface DisplayMessage {
  type: "display";
  view?: "color" | "depth" | "opacity" | "normals";
  before?: boolean;
  split?: number | null;
}
/**
 * A drag of an edit's cages begins.
 */
export interface DragBegin {
  type: "drag_begin";
  drag: number;
  edit: number;
  target: "field" | "inner" | "outer" | "both";
}
/**
 * The drag is given up: everything as before it.
 */
export interface DragCancel {
  type: "drag_cancel";
  drag: number;
}
/**
 * The drag ends with this operation, which becomes one entry of the history.
 */
export interface DragEnd {
  type: "drag_end";
  drag: number;
  seq: number;
  operation:
    | TranslateBy
    | RotateBy
    | ScaleBy
    | ShearBy
    | MoveCornersBy
    | MovePointBy
    | MovePointsBy
    | BendBy
    | TwistBy
    | TaperBy
    | MirrorBy;
}
/**
 * The mouse has come to a handle of a cage: background work waits for a moment.
 */
export interface DragExpected {
  type: "drag_expected";
}
/**
 * Where the drag is: the whole operation since its beginning.
 */
export interface DragMove {
  type: "drag";
  drag: number;
  seq: number;
  operation:
    | TranslateBy
    | RotateBy
    | ScaleBy
    | ShearBy
    | MoveCornersBy
    | MovePointBy
    | MovePointsBy
    | BendBy
    | TwistBy
    | TaperBy
    | MirrorBy;
}
/**
 * Images that the page draws itself: none, those during motion, or all. It receives the edits instead.
 */
export interface Drawing {
  type: "drawing";
  here: "nothing" | "moving" | "all";
}
/**
 * Writes a page that shows the edited scene, to be downloaded; in the background.
 *
 * One HTML file; with `levels` of detail, of splats, a zip archive of a folder for a web site. Such a page
 * holds at most `budget` splats at a time, if given.
 */
export interface ExportPage {
  type: "export_page";
  levels?: boolean;
  budget?: number | null;
}
/**
 * Writes the edited splats, the edits baked in, to a file to be downloaded; in the background.
 *
 * With `along_path`, those of each frame of the camera path: time samples of a USD file, else a zip archive
 * of a file for each frame. Splats beyond the number `splats` are merged, those of a moment alone. Levels of
 * detail (`lod`) are of a moment, too.
 */
export interface ExportSplats {
  type: "export";
  form: "ply" | "compressed.ply" | "spz" | "sog" | "lod" | "splat" | "glb" | "usda" | "usdc" | "usdz";
  splats?: number | null;
  along_path?: boolean;
  fps?: number;
}
/**
 * Shrinks the inner cage to the dense region inside it.
 */
export interface FitInner {
  type: "fit_inner";
  edit: number;
}
/**
 * Goes to an entry of the history, 0 the beginning.
 */
export interface GoTo {
  type: "go_to";
  entry: number;
}
/**
 * Camera from which a hotspot is looked at.
 */
export interface HotspotCamera {
  c2w: number[];
  fov_y_deg: number;
}
/**
 * Shows the selected elements alone, on all pages, or all again.
 */
export interface Isolate {
  type: "isolate";
  on: boolean;
}
/**
 * A keyframe of a camera path: a camera, and how far each edit has gone (1 where it is not named).
 */
export interface Key {
  c2w: number[];
  fov_y_deg: number;
  seconds: number;
  parts: {
    [k: string]: number | undefined;
  };
}
/**
 * An edit file's text: replaces the stack, or (paste) is appended to it.
 */
export interface LoadEdits {
  type: "load_edits";
  text: string;
  append?: boolean;
}
/**
 * A mirrored copy of an edit's cages and operations, across the plane through the scene's middle.
 */
export interface Mirror {
  type: "mirror";
  edit: number;
  axis: "x" | "y" | "z";
}
/**
 * Puts a hotspot at another place in the list, 0 first; None removes it.
 */
export interface MoveHotspot {
  type: "move_hotspot";
  hotspot: number;
  to?: number | null;
}
/**
 * Makes the outer cage a margin around everything the inner cage is and was.
 */
export interface OuterMargin {
  type: "outer_margin";
  edit: number;
  margin: number;
}
/**
 * A new edit: all of another scene, or of a file of splats, upright on the surface amid the picture.
 *
 * The path is one of the answer to `ask` for "sources", or any other under the server's root.
 */
export interface PasteScene {
  type: "paste_scene";
  source: string;
}
/**
 * A new edit: a cage pair around the surface seen at a pixel (x, y in [0,1] of the camera's picture).
 *
 * Without a pixel it goes around the middle of the visible surface.
 */
export interface Place {
  type: "place";
  x?: number | null;
  y?: number | null;
}
/**
 * A new edit with a mesh cage, from a file's name and its content in base64, world units.
 */
export interface PlaceMesh {
  type: "place_mesh";
  name: string;
  content: string;
}
/**
 * A new edit of one control point, on the surface seen at a pixel (x, y in [0,1] of the picture).
 *
 * Without a pixel it goes to the middle of the visible surface.
 */
export interface PlacePoint {
  type: "place_point";
  x?: number | null;
  y?: number | null;
}
/**
 * Where on the path the page is; passed over where that preview is over.
 */
export interface Play {
  type: "play";
  play: number;
  seconds: number;
}
/**
 * The page plays the camera path: pictures show the edits as its video will, at its beginning first.
 */
export interface PlayBegin {
  type: "play_begin";
  play: number;
}
/**
 * The page plays no more: pictures show the edits as they are.
 */
export interface PlayEnd {
  type: "play_end";
  play: number;
}
/**
 * Reach of an edit's control points, world units, the curve by which it fades, and whether distances go
 * through dense matter alone; omitted ones stay.
 */
export interface PointReach {
  type: "point_reach";
  edit: number;
  radius?: number | null;
  falloff?: ("smooth" | "sphere" | "root" | "sharp" | "linear") | null;
  connected?: boolean | null;
}
/**
 * The page has shown an image, or its edits; until then the server sends at most one more.
 */
export interface PresentedMessage {
  type: "presented";
  picture: number;
}
/**
 * A hotspot with all its values: a new one without a number, else in place of that one.
 */
export interface PutHotspot {
  type: "put_hotspot";
  hotspot?: number | null;
  title: string;
  text?: string;
  position: Vec3;
  camera?: HotspotCamera | null;
  follows?: boolean;
}
/**
 * Deletes the selected elements from the field, or restores all that were deleted.
 */
export interface RemoveElements {
  type: "remove_elements";
  restore?: boolean;
}
/**
 * Renders the test views to PNGs in a folder, or the camera path to an MP4; in the background.
 */
export interface RenderJob {
  type: "render";
  what: "test_views" | "camera_path";
  out: string;
  width?: number;
  height?: number;
  fps?: number;
  overwrite?: boolean;
}
/**
 * Puts an edit at another place in the stack, 0 first.
 */
export interface Reorder {
  type: "reorder";
  edit: number;
  to: number;
}
/**
 * Saves the scene, edits included, as a new folder on the server's machine.
 */
export interface SaveAs {
  type: "save_as";
  path: string;
  overwrite?: boolean;
}
/**
 * Change the scene's scale; None forgets it.
 */
export interface ScaleChange {
  type: "scale_change";
  meters_per_unit: number | null;
}
/**
 * Change options that hold for all edits.
 */
export interface SceneChange {
  type: "scene_change";
  preserve_opacity: boolean;
}
/**
 * Picks probable floaters, few at strength 0 and many at 1.
 */
export interface SelectFloaters {
  type: "select_floaters";
  strength?: number;
  mode?: "replace" | "add" | "subtract" | "intersect";
}
/**
 * Picks the elements connected to the surface at a pixel by cells of some opacity.
 */
export interface SelectFlood {
  type: "select_flood";
  x: number;
  y: number;
  threshold?: number;
  reach?: number;
  mode?: "replace" | "add" | "subtract" | "intersect";
}
/**
 * Picks elements by the range of an attribute.
 */
export interface SelectRange {
  type: "select_range";
  attribute: "size" | "opacity" | "red" | "green" | "blue" | "hue" | "saturation" | "value";
  low: number;
  high: number;
  mode?: "replace" | "add" | "subtract" | "intersect";
}
/**
 * Picks elements in a region of the picture.
 *
 * The points are two opposite corners of a rectangle, the vertices of a lasso, or those of a brush stroke.
 */
export interface SelectRegion {
  type: "select_region";
  shape: "rectangle" | "lasso" | "brush";
  points: [number, number][];
  radius?: number;
  mode?: "replace" | "add" | "subtract" | "intersect";
  through?: boolean;
  tolerance?: number;
}
/**
 * A new edit with an inner cage around the selected elements as they are seen.
 *
 * A "box" is oriented, a "lattice" that box divided into cells near to cubes, a "mesh" closed and decimated.
 */
export interface SelectionCage {
  type: "selection_cage";
  cage?: "box" | "lattice" | "mesh";
  margin?: number;
}
/**
 * A cage's corners by number, in Set mode: nothing of the field moves.
 */
export interface SetCage {
  type: "set_cage";
  edit: number;
  cage: "inner" | "outer";
  corners: Corners;
}
/**
 * The camera path's keyframes; saved with the scene.
 */
export interface SetPath {
  type: "set_path";
  keys: Key[];
  loop?: boolean;
}
/**
 * The inner cage becomes a lattice with that many cells along its x, y and z.
 */
export interface Subdivide {
  type: "subdivide";
  edit: number;
  /**
   * @minItems 3
   * @maxItems 3
   */
  cells: [number, number, number];
  interpolation?: "linear" | "bspline";
}
/**
 * Makes the tour of the shown hotspots the camera path, which rests `stop` seconds at each.
 */
export interface TourPath {
  type: "tour_path";
  stop?: number;
}
/**
 * Change the scene's up direction.
 *
 * "points": the normal of a level plane through three points; "floor": that of the dominant plane of the
 * scene's surfaces; "cameras": forgets it, so that it is that of the cameras.
 */
export interface UpChange {
  type: "up_change";
  by: "points" | "floor" | "cameras";
  points?: Vec3[];
}
/**
 * The answer to an `ask`: a point and its normal, a text, a grid, the path, sources, or a histogram; or
 * nothing.
 */
export interface Answer {
  type: "answer";
  request: number;
  point: Vec3 | null;
  normal: Vec3 | null;
  text: string | null;
  grid: Vec3[][];
  stills: Still[];
  tracks: HotspotTrack[];
  sources: string[];
  histogram: HistogramCounts | null;
  failed: boolean;
}
/**
 * A camera on the camera path.
 */
export interface Still {
  c2w: number[];
  fov_y_deg: number;
}
/**
 * Positions of a hotspot, deformed space, at even times of the camera path; null where it is hidden.
 */
export interface HotspotTrack {
  hotspot: number;
  places: (Vec3 | null)[];
}
/**
 * Counts of an attribute's values in even bins between two ends; of sizes, even in their logarithm.
 */
export interface HistogramCounts {
  low: number;
  high: number;
  counts: number[];
  selected: number[];
}
/**
 * Map of an edit's cages to where its parents carry them during a drag; see `EditState.carrier`.
 */
export interface Carried {
  edit: number;
  carrier: number[] | null;
}
/**
 * The page's drag was given up, by a step of the history or the removal of its edit; a notice says so.
 */
export interface DragOver {
  type: "drag_over";
  drag: number;
}
/**
 * Result of a `drag`: `part` of the operation was followed; `why` where `part` is below 1.
 */
export interface Dragged {
  type: "dragged";
  drag: number;
  seq: number;
  part: number;
  why: string | null;
  inner: Corners;
  deformed: Corners;
  outer: Corners | null;
  points: Vec3[];
  deformed_points: Vec3[];
  carried: Carried[];
}
/**
 * One edit as pages show it; corners in world units, deformed: the inner cage after its operations.
 */
export interface EditState {
  id: number;
  name: string;
  color: string;
  enabled: boolean;
  locked: boolean;
  kind: "continuous" | "move" | "copy" | "delete";
  source: string | null;
  shell: "flow" | "trilinear";
  falloff: "smooth" | "linear";
  width: number;
  fill: "surroundings" | "none";
  relight: "occlusion" | "shadow" | "none";
  lattice: number;
  lattice_error: [number, number] | null;
  inner: Corners;
  deformed: Corners;
  outer: Corners | null;
  cage: "box" | "lattice" | "points" | "mesh";
  points: PointsState | null;
  outer_follows: boolean;
  pivot: Vec3;
  inner_pivot: Vec3;
  outer_pivot: Vec3 | null;
  operations: string[];
  grade: GradeValues;
  parent: number | null;
  carrier: number[] | null;
  problem: string | null;
}
/**
 * Control points of an edit's inner cage, world units: of a lattice, or on their own with a radius.
 */
export interface PointsState {
  canonical: Vec3[];
  deformed: Vec3[];
  shape: [number, number, number] | null;
  edges: [number, number][] | null;
  interpolation: ("linear" | "bspline") | null;
  radius: number | null;
  falloff: ("smooth" | "sphere" | "root" | "sharp" | "linear") | null;
  connected: boolean;
}
/**
 * First message, with the edited scene. `page` identifies this page among the open ones.
 */
export interface Hello {
  type: "hello";
  version: string;
  page: number;
  scene: string;
  field: string;
  name: string;
  splats: boolean;
  /**
   * @minItems 2
   * @maxItems 2
   */
  bounds: [Vec3, Vec3];
  voxel: number;
  up: Vec3;
  start: CameraMessage;
  cameras: number[][];
  read_only: boolean;
}
/**
 * A hotspot: its number, texts, position in deformed space, and the camera to look from, if any.
 *
 * `follows`: the edits carry it along; `hidden`: they have deleted or covered its place.
 */
export interface HotspotState {
  id: number;
  title: string;
  text: string;
  position: Vec3;
  camera: HotspotCamera | null;
  follows: boolean;
  hidden: boolean;
}
/**
 * How far a background job is; of one whose file is to be downloaded, `page` asked for it.
 */
export interface Job {
  type: "job";
  job: number;
  page: number;
  what: ("test_views" | "camera_path") | ("splats" | "page");
  state: "running" | "done" | "cancelled" | "failed";
  done: number;
  total: number;
  out: string;
  text: string;
}
/**
 * A line for the user.
 */
export interface Notice {
  type: "notice";
  level: "info" | "warning" | "error";
  text: string;
}
/**
 * Progress of the renderer's kernels: compiled by a machine's first run, loaded by later ones.
 */
export interface Preparing {
  type: "preparing";
  done: number;
  of: number;
}
/**
 * A page's preview of the camera path has begun, or is over; `play` is that page's number for it.
 */
export interface Preview {
  type: "preview";
  page: number;
  play: number;
  on: boolean;
}
/**
 * Number of selected elements of the field, splats or cells of a grid, and of all.
 */
export interface SelectionCount {
  count: number;
  total: number;
}
/**
 * Everything that pages show of the edits; sent to all pages after each change.
 */
export interface State {
  type: "state";
  revision: number;
  pictured: number;
  edits: EditState[];
  selected: number | null;
  history: string[];
  entry: number;
  saved: boolean;
  path: string;
  is_file: boolean;
  preserve_opacity: boolean;
  meters_per_unit: number | null;
  up: Vec3 | null;
  keys: Key[];
  loop: boolean;
  hotspots: HotspotState[];
  selection: SelectionCount | null;
  removed: SelectionCount | null;
  isolated: boolean;
}
/**
 * Heads a binary message: uint32 (little endian) length of this JSON, the JSON, the picture, the depth.
 *
 * The picture is a JPEG of `width` x `height` or, where it is small, its RGB bytes row by row: the part at
 * (x, y) of a picture of full_width x full_height that covers the page's view; smaller ones are stretched.
 * `depth_bytes` of uint16 (little endian, row by row, depth_width x depth_height, over the same part) follow
 * it: distance along the ray = value * depth_scale, 65535 where there is nothing.
 */
export interface PictureHeader {
  type: "picture";
  picture: number;
  camera: number;
  drag: number;
  seq: number;
  revision: number;
  view: "color" | "depth" | "opacity" | "normals";
  before: boolean;
  split: number | null;
  x: number;
  y: number;
  width: number;
  height: number;
  full_width: number;
  full_height: number;
  whole: boolean;
  refinement: number;
  final: boolean;
  format: "jpeg" | "rgb";
  picture_bytes: number;
  depth_bytes: number;
  depth_width: number;
  depth_height: number;
  depth_scale: number;
  render_ms: number;
  encode_ms: number;
}
/**
 * Heads a binary message to a page that draws itself as PictureHeader does; a file of the edits follows.
 *
 * The file is one of `cagefield.pages.page_edits`, without parts that were sent before, or of
 * `cagefield.pages.page_splat_edits`; it is empty where the edits cannot be drawn by a page, and `why`
 * says why. The page answers `presented` when it shows them.
 */
export interface EditsHeader {
  type: "edits";
  picture: number;
  drag: number;
  seq: number;
  revision: number;
  final: boolean;
  why: string | null;
  map_ms: number;
  encode_ms: number;
}
/**
 * Heads a binary message with positions at which selected elements are seen, after each change of them.
 *
 * `count` positions follow the header, each as uint16 (little endian) x, y, z: 0 at `low`, 65535 at `high`.
 */
export interface HighlightHeader {
  type: "highlight";
  count: number;
  low: Vec3;
  high: Vec3;
  size: number;
}
