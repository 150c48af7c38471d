/** Files of splats that are sent to the server, to be opened there. */

/** What the server reads, by the ends of names. */
export const SPLATS = [".ply", ".spz", ".sog", ".splat", ".ksplat", ".glb", ".gltf"];

export function isSplats(name: string): boolean {
  return SPLATS.some((end) => name.toLowerCase().endsWith(end));
}

/** The address that a file is sent to, with the page's token where its link has one. */
export function openAddress(page: Location, name: string): string {
  const address = new URL("open", page.href);
  const query = new URLSearchParams(page.search);
  query.set("name", name);
  address.search = query.toString();
  address.hash = "";
  return address.href;
}

/** What of an XMLHttpRequest is used, so that tests can stand in for it: fetch tells nothing of what it has sent. */
export type Request = Pick<
  XMLHttpRequest,
  "open" | "send" | "status" | "responseText" | "onload" | "onerror"
> & {
  upload: Pick<XMLHttpRequestUpload, "onprogress">;
};

/** Sends a file; null once it is opened, else why it is not. `progress` is told what share has been sent. */
export function send(
  request: Request,
  file: File,
  address: string,
  progress: (share: number) => void,
): Promise<string | null> {
  return new Promise((resolve) => {
    request.upload.onprogress = ({ loaded, total }) => progress(total > 0 ? loaded / total : 0);
    request.onload = () =>
      resolve(
        request.status === 200
          ? null
          : request.responseText.trim() || `the server refused it (${request.status})`,
      );
    request.onerror = () => resolve(`${file.name} could not be sent: the server is gone`);
    request.open("POST", address);
    request.send(file);
  });
}
