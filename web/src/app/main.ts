import "../ui/editor.css";
import { Actions } from "../editing/actions";
import { App } from "./app";
import { testApi } from "./test_api";
import { bindings, listenForKeys } from "../editing/keys";
import { MeasureTool } from "../editing/measure_tool";
import { PointPicker } from "../editing/point_picker";
import { Pointer } from "../editing/pointer";
import { RegionTools } from "../editing/region_tools";
import { storeSession } from "./session_storage";
import { READ_ONLY_NOTICE, isReadOnly } from "./store";
import { alignmentPanel } from "../ui/alignment_panel";
import { dialogs } from "../ui/dialogs";
import { h } from "../ui/dom";
import { editsList } from "../ui/edits_list";
import { help } from "../ui/help";
import { historyList } from "../ui/history_list";
import { Hotspots } from "../ui/hotspot_list";
import { jobs } from "../ui/jobs";
import { options } from "../ui/options";
import { overlay } from "../ui/overlay";
import { pathList } from "../ui/path_list";
import { selectionPanel } from "../ui/selection_panel";
import { status } from "../ui/status";
import { toolbar } from "../ui/toolbar";
import { topbar } from "../ui/topbar";

const view = h("main", { class: "view" });
const root = h("div", { class: "editor" }, view);
document.body.append(root);

const app = new App(view);
const questions = dialogs(app);
const actions = new Actions(app, () => questions.saveAs());
const regions = new RegionTools(app);
const pointer = new Pointer(app);
const measure = new MeasureTool(app, (distance) => questions.scale(distance));
const hotspots = new Hotspots(app, actions, questions);
pointer.placeHotspot = (x, y) => hotspots.place(x, y);
const picker = new PointPicker(app, {
  plane: (points) => app.send({ type: "up_change", by: "points", points }),
  pairs: (pairs) => questions.align(pairs),
});
pointer.pickPoint = (x, y) => picker.add(x, y);
pointer.measure = (x, y) => measure.add(x, y);
const keys = bindings(app, actions, pointer, regions, questions);
listenForKeys(app, actions, pointer, keys);

// Buttons and fields of a read-only page are disabled.
const controls = h(
  "fieldset",
  { class: "controls" },
  editsList(app, actions, questions),
  options(app, actions),
  selectionPanel(app, actions),
  historyList(app),
  pathList(app, actions, questions),
  hotspots.panel,
  alignmentPanel(app, actions),
  jobs(app),
);
const panel = h("aside", { class: "panel" }, controls);
view.append(regions.element, measure.element, picker.element, hotspots.marks, overlay(app, pointer));
root.append(
  topbar(app, actions, questions),
  toolbar(app, actions),
  panel,
  status(app),
  help(app, keys),
  questions.element,
);
app.store.watch(["hello"], (now) => {
  controls.disabled = isReadOnly(now);
  root.classList.toggle("looking", isReadOnly(now));
});
app.store.watch(["panel"], (now) => root.classList.toggle("wide", !now.panel));
app.store.watch(["state", "hello"], ({ hello, state }) => {
  document.title = `${state?.saved === false ? "● " : ""}${hello?.name ?? "cagefield"}`;
});
addEventListener("beforeunload", (event) => {
  if (app.store.now.hello !== null) storeSession(app.store.now, app.viewport.c2w);
  if (app.store.now.state?.saved === false && !isReadOnly(app.store.now)) event.preventDefault();
});
addEventListener("dragover", (event) => {
  if (event.dataTransfer?.types.includes("Files")) event.preventDefault();
});
addEventListener("drop", (event) => {
  const file = event.dataTransfer?.files[0];
  if (file === undefined) return;
  event.preventDefault();
  if (isReadOnly(app.store.now)) app.say(READ_ONLY_NOTICE, "warning");
  else void actions.load(file);
});
document.addEventListener("visibilitychange", () => {
  if (document.hidden) app.player.stop();
});
window.cagefield = testApi(app);
