/** Jobs whose file is downloaded by the page that asked for it. */
import type { Job } from "../net/protocol";

export function isDownload(job: Pick<Job, "what">): boolean {
  return job.what === "splats" || job.what === "page";
}
