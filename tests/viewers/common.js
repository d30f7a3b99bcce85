// SPDX-License-Identifier: Apache-2.0
// Parts that all pages use: the job from the address, and the picture to the server.
export const job = JSON.parse(new URLSearchParams(location.search).get("job"));

async function send(path, body) {
  const reply = await fetch(`${path}?job=${encodeURIComponent(job.name)}`, { method: "POST", body });
  location.replace(await reply.text()); // the next job
}
const fail = fault => send("/failed", String((fault && (fault.stack || fault.message)) || fault));
addEventListener("error", event => fail(event.error || event.message));
addEventListener("unhandledrejection", event => fail(event.reason));

export function makeCanvas() {
  const canvas = document.createElement("canvas");
  canvas.width = job.width;
  canvas.height = job.height;
  canvas.style.cssText = `width:${job.width}px;height:${job.height}px`;
  document.body.style.margin = 0;
  document.body.append(canvas);
  return canvas;
}

// Columns right, down and forward of the camera become right, up and back; four columns one after the other.
export function cameraMatrix() {
  const r = job.rotation, p = job.position;
  return [r[0][0], r[1][0], r[2][0], 0, -r[0][1], -r[1][1], -r[2][1], 0, -r[0][2], -r[1][2], -r[2][2], 0, ...p, 1];
}

// Sends the last frame drawn, the number of Gaussians that the viewer holds, and in `more` other facts of the page.
export async function sendPicture(canvas, gaussians, more = {}) {
  const png = canvas.toDataURL("image/png");
  await send("/picture", JSON.stringify({ gaussians, png: png.slice(png.indexOf(",") + 1), ...more }));
}
