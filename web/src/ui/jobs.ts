/** Background jobs with their progress and a button to cancel them. */
import { X } from "lucide";
import type { App } from "../app/app";
import { isDownload } from "../app/downloads";
import type { Job } from "../net/protocol";
import { h, iconButton } from "./dom";

const WHAT: Record<Job["what"], string> = {
  test_views: "Test views",
  camera_path: "Video",
  splats: "Splats",
  page: "Page",
};
const GONE_AFTER = 8000;

export function jobs(app: App): HTMLElement {
  const list = h("div", { class: "jobs" });
  app.store.watch(["jobs"], (now) => {
    list.replaceChildren(...now.jobs.map((job) => jobRow(app, job)));
    for (const job of now.jobs.filter((each) => each.state !== "running")) {
      setTimeout(() => {
        app.store.set({ jobs: app.store.now.jobs.filter((other) => other !== job) });
      }, GONE_AFTER);
    }
  });
  return list;
}

function describeJob(job: Job): string {
  const file = isDownload(job);
  if (job.state === "running")
    return file && job.total === 1 ? `writing ${job.out}` : `${job.done} of ${job.total}`;
  if (job.state === "done") return file ? `${job.out} is ready` : `written to ${job.out}`;
  return job.text || job.state;
}

function jobRow(app: App, job: Job): HTMLElement {
  const bar = h("progress", { max: Math.max(1, job.total) });
  // A progress bar without a value shows activity alone.
  if (job.total > 1 || !isDownload(job) || job.state !== "running") bar.value = job.done;
  const stop =
    job.state === "running"
      ? iconButton(X, "Cancel", () => app.send({ type: "cancel_job", job: job.job }), "cancel")
      : null;
  return h(
    "div",
    { class: `job ${job.state}` },
    h(
      "div",
      { class: "row" },
      h("strong", {}, WHAT[job.what]),
      h("span", { class: "quiet", title: job.out }, describeJob(job)),
      stop,
    ),
    bar,
  );
}
