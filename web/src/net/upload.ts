/** Upload of splat files, which the server then opens. */

/** Suffixes of the file names that the server reads. */
export const SPLAT_SUFFIXES = [".ply", ".spz", ".sog", ".splat", ".ksplat", ".glb", ".gltf"];

export function isSplatFile(name: string): boolean {
  return SPLAT_SUFFIXES.some((end) => name.toLowerCase().endsWith(end));
}

/** Address of the upload, with the token of the page's link, if any. */
export function uploadAddress(page: Location, name: string): string {
  const address = new URL("open", page.href);
  const query = new URLSearchParams(page.search);
  query.set("name", name);
  address.search = query.toString();
  address.hash = "";
  return address.href;
}

/**
 * The members of an XMLHttpRequest that are used; tests substitute them. `fetch` reports no upload progress.
 */
export type Request = Pick<
  XMLHttpRequest,
  "open" | "send" | "status" | "responseText" | "onload" | "onerror"
> & {
  upload: Pick<XMLHttpRequestUpload, "onprogress">;
};

/**
 * Sends a file; null once the server has opened it, else the reason of the failure. `progress` gets the sent
 * share.
 */
export function uploadFile(
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
