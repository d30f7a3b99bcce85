# SPDX-License-Identifier: Apache-2.0
"""Shows what gsc export writes in PlayCanvas and Spark, in Chromium without a GPU, and compares it with our own picture.

usage: check_viewers.py --gsc GSC --play GSC_PLAY --work FOLDER [--all]

One camera's Gaussians of the trained model fox_scaffold, or of a sample where GSC_CHECKPOINTS has no models, as a page of
--html, opened from the file system, and as each file that a viewer reads: in one viewer for each format; with --all in every
viewer, splat-transform reads them back, and Khronos' validator reads the GLB. Pages and files come from a server on the
loopback address; a page sends its picture back. The server gives finer levels of a streamed SOG once a page has drawn
the coarsest. Exit code 77: something is missing here.
"""
import argparse
import base64
import contextlib
import http.server
import json
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
from pathlib import Path

HERE = Path(__file__).parent
FLAGS = ["--headless=new", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox",
         "--no-first-run", "--disable-extensions", "--disable-background-networking", "--hide-scrollbars"]
SECONDS = 200  # for a picture that takes a few
BARS = {"fox_scaffold": 37.0, "sample": 34.0}  # dB: below what the viewers' own arithmetic leaves
UNSUPPORTED = 5  # gsc's exit code
# Addition to a copy of a page: it sends a picture of the camera's size by a form, since the page may connect nowhere.
SENDER = """<style>#canvas { width: WIDTHpx; height: HEIGHTpx }</style>
<form method="post" action="SERVER/picture?job=page"><input name="picture"></form>
<script>
(async () => {
  const pause = () => new Promise(resolve => setTimeout(resolve, 100));
  const state = document.getElementById("state"), send = value => {
    document.querySelector("[name=picture]").value = JSON.stringify(value);
    document.forms[0].submit();
  };
  while (state.textContent.startsWith("Loading"))
    await pause();
  if (state.textContent !== "")
    return send({ fault: state.textContent });
  const app = window.gsc.app;
  let ready = false;
  app.systems.gsplat.on("frame:ready", (_camera, _layer, sorted, loading) => { ready = sorted && loading === 0; });
  app.on("frameend", () => {
    if (!ready)
      return;
    const png = document.getElementById("canvas").toDataURL("image/png");
    send({ gaussians: JSON.parse(document.getElementById("model").textContent).gaussians.count, png: png.slice(22) });
    app.destroy();
  });
  window.gsc.look();
})();
</script>"""
ONCE = [("page", "html"), ("playcanvas", "ply"), ("playcanvas", "sog"), ("playcanvas", "lod"), ("playcanvas", "glb"),
        ("spark", "spz")]
ALL = ONCE + [("spark", "ply"), ("spark", "sog"), ("playcanvas", "spz4")]
# Form: its file, and the arguments of gsc export that make it.
FORMS = {"html": ("view.html", ["--html"]), "ply": ("view.ply", ["--to", "ply", "-o"]),
         "lod": ("levels/lod-meta.json", ["--to", "sog", "--lod", "-o"]),
         "glb": ("view.glb", ["--to", "glb", "-o"]), "sog": ("view.sog", ["--to", "sog", "-o"]),
         "spz": ("view.spz", ["--to", "spz", "-o"]),
         "spz4": ("view4.spz", ["--to", "spz", "--spz-version", 4, "-o"])}


def missing():
    if not (HERE / "node_modules/playcanvas").exists():
        return "the viewers are not here; npm ci --omit=dev --ignore-scripts --prefix tests/viewers fetches them"
    return "" if shutil.which("chromium") else "no chromium here; install chromium"


class Viewers:
    """Chromium and the server that gives it one job after the other."""

    def __init__(self, files):
        self.files, self.jobs, self.results, self.ended = files, [], {}, queue.Queue()
        self.coarsest, self.drawn = 0, threading.Event()  # level of the streamed SOG, and whether a page drew it

    def handler(self):
        viewers = self

        class Handler(http.server.SimpleHTTPRequestHandler):
            extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".mjs": "text/javascript"}

            def translate_path(self, path):
                path = urllib.parse.unquote(urllib.parse.urlsplit(path).path)
                for start, folder in (("/packages/", HERE / "node_modules"), ("/files/", viewers.files), ("/", HERE)):
                    if path.startswith(start):
                        return str(folder / path[len(start):])

            def do_GET(self):
                level = re.match(r"/files/levels/(\d+)_", self.path)
                if level and int(level[1]) < viewers.coarsest:
                    viewers.drawn.wait(SECONDS)
                if self.path == "/drawn":
                    viewers.drawn.set()
                    self.send_response(204)
                    self.end_headers()
                else:
                    super().do_GET()

            def do_POST(self):
                address = urllib.parse.urlsplit(self.path)
                name = urllib.parse.parse_qs(address.query)["job"][0]
                body = self.rfile.read(int(self.headers["Content-Length"])).decode()
                form = name == "page"
                if form:
                    body = urllib.parse.parse_qs(body)["picture"][0]
                viewers.results[name] = json.loads(body) if address.path == "/picture" else {"fault": body}
                following = viewers.next_page()
                self.send_response(303 if form else 200)
                if form:
                    self.send_header("Location", following)
                self.end_headers()
                self.wfile.write(following.encode())
                viewers.ended.put(name)

            def log_message(self, *_):
                pass

        return Handler

    def next_page(self):
        if not self.jobs:
            return "about:blank"
        job = self.jobs.pop(0)
        if job["viewer"] == "page":  # from the file system
            copy = self.files / "copy.html"
            sender = SENDER.replace("WIDTH", str(job["width"])).replace("HEIGHT", str(job["height"]))
            copy.write_text((self.files / "view.html").read_text().replace(
                "</body>", sender.replace("SERVER", self.address) + "</body>"))
            return copy.resolve().as_uri()
        return f"{self.address}/{job['viewer']}.html?job={urllib.parse.quote(json.dumps(job))}"

    def run(self, jobs):
        """By each job's name the answer of its page: {gaussians, png} or {fault}."""
        self.jobs = list(jobs)  # a page of the file system first: others may not lead to it
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), self.handler())
        self.address = f"http://127.0.0.1:{server.server_address[1]}"
        threading.Thread(target=server.serve_forever, daemon=True).start()
        # one picture's pixels are one of the page's
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, contextlib.ExitStack() as stack:
            stack.callback(server.server_close)
            stack.callback(server.shutdown)
            chromium = subprocess.Popen(
                [shutil.which("chromium"), *FLAGS, "--force-device-scale-factor=1", f"--user-data-dir={profile}",
                 self.next_page()],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            stack.callback(lambda: (chromium.terminate(), chromium.wait()))
            with contextlib.suppress(queue.Empty):
                for _ in jobs:
                    self.ended.get(timeout=SECONDS)
        fault = {"fault": f"no picture: a page took longer than {SECONDS} s"}
        return {job["name"]: self.results.get(job["name"], fault) for job in jobs}


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE).stdout


def model(arguments, work):
    """Its name and folder."""
    trained = Path(os.environ.get("GSC_CHECKPOINTS", HERE.parents[2] / "shared/checkpoints")) / "fox_scaffold"
    if trained.exists():
        return trained.name, trained
    run(arguments.gsc, "sample", "room", "--anchors", 5000, "--seed", 1, "-o", work / "sample", "-q")
    return "sample", work / "sample"


def camera_of(folder):
    camera = json.loads((folder / "cameras.json").read_text())[0]
    return {key: camera[key] for key in ("width", "height", "fx", "fy", "position", "rotation")}


def node_tool(path):
    """The command that runs a script of a package, none where it or Node 20 is missing."""
    script = HERE / "node_modules" / path
    if not script.exists() or not shutil.which("node"):
        return None
    return ["node", script] if int(run("node", "--version").decode()[1:].split(".")[0]) >= 20 else None


def read_back(path, count):
    """Whether the second reader agrees; of levels count is a list."""
    tool = node_tool("@playcanvas/splat-transform/bin/cli.mjs")
    if path.suffix in (".glb", ".html") or tool is None:
        print(f"{path.name}: not read back, splat-transform " + ("does not read it" if tool else "or Node 20 is missing"))
        return True
    info = json.loads(run(*tool, "--quiet", path, "--info", "json", "null"))
    found = info["lodCounts"] if isinstance(count, list) else info["numGaussians"]
    print(f"{path.name}: {count} Gaussians, splat-transform reads {found}")
    return found == count


def validate(path):
    """Whether Khronos' validator finds no error."""
    if node_tool("gltf-validator/index.js") is None:
        print(f"{path.name}: not validated, gltf-validator or Node 20 is missing")
        return True
    script = ("require(process.argv[1]).validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[2])))"
              ".then(report => console.log(JSON.stringify(report.issues)))")
    # an attribute of an extension that this validator does not know yet counts as a wrong name
    errors = [issue for issue in json.loads(run("node", "-e", script, HERE / "node_modules/gltf-validator", path))["messages"]
              if issue["severity"] == 0 and not (issue["code"] == "MESH_PRIMITIVE_INVALID_ATTRIBUTE" and
                                                 "/attributes/KHR_gaussian_splatting:" in issue["pointer"])]
    print(f"{path.name}: gltf-validator finds {len(errors)} errors", *errors, sep="\n")
    return not errors


def export(arguments, form):
    """The report, None where this build cannot write the format."""
    name, options = FORMS[form]
    output = arguments.work / "files" / name.split("/")[0]  # with levels a folder
    command = [arguments.gsc, "export", arguments.work / "model.gsc", *options, output, "--at", 0, "--format", "json", "-q"]
    result = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if result.returncode == UNSUPPORTED:
        print("note: " + result.stderr.strip())
        return None
    result.check_returncode()
    return json.loads(result.stdout)


def psnr_of(arguments, png, name):
    """PSNR of a page's picture, which is kept in folder `name`; dB."""
    folder = arguments.work / name
    folder.mkdir()
    (folder / "picture.png").write_bytes(base64.b64decode(png))
    report = run(arguments.gsc, "compare-pictures", arguments.work / "exact", folder, "--format", "json", "-q")
    return json.loads(report)["scores"]["psnr"]


def main():
    parser = argparse.ArgumentParser()
    for name in ("--gsc", "--play", "--work"):
        parser.add_argument(name, type=Path, required=True)
    parser.add_argument("--all", action="store_true")
    arguments = parser.parse_args()
    if missing():
        print("skipped: " + missing())
        return 77
    work = arguments.work
    shutil.rmtree(work, ignore_errors=True)
    (work / "files").mkdir(parents=True)
    name, folder = model(arguments, work)
    run(arguments.gsc, "convert", folder, "-o", work / "model.gsc", "--sensitivity", "none", "-q")
    run(arguments.play, work / "model.gsc", "--tier", "exact", "--backend", "cpu", "--frames", "0:1", "--out",
        work / "exact/picture.png", "-q")
    camera = camera_of(folder)
    views, bad = ALL if arguments.all else ONCE, 0
    counts, levels = {}, {}
    for form in dict.fromkeys(form for _, form in views):
        path = work / "files" / FORMS[form][0]
        report = export(arguments, form)
        if report is None:
            continue
        counts[form] = report["gaussians"]["count"]
        levels[form] = [level["count"] for level in report["gaussians"].get("lods", [])]
        if arguments.all:
            bad += not read_back(path, levels[form] or counts[form])
            bad += form == "glb" and not validate(path)
    views = [(viewer, form) for viewer, form in views if form in counts]
    jobs = [{"name": "page" if viewer == "page" else f"{viewer}_{form}", "viewer": viewer,
             "file": f"/files/{FORMS[form][0]}", **camera} for viewer, form in views]
    start = time.monotonic()
    viewers = Viewers(work / "files")
    viewers.coarsest = len(levels.get("lod", [])) - 1
    results = viewers.run(jobs)
    print(f"{name}: {len(jobs)} pictures in {time.monotonic() - start:.1f} s")
    for (viewer, form), job in zip(views, jobs):
        result = results[job["name"]]
        if "fault" in result:
            print(f"{job['name']}: {result['fault']}")
            bad += 1
            continue
        psnr = psnr_of(arguments, result["png"], job["name"])
        good = psnr >= BARS[name] and result["gaussians"] == counts[form]
        print(f"{job['name']}: {psnr:.2f} dB, expected at least {BARS[name]}; {result['gaussians']} Gaussians, expected "
              f"{counts[form]}{'' if good else ': FAILED'}")
        bad += not good
        if levels[form]:
            drawn, wanted = result["drawn"], levels[form]
            streams = len(wanted) > 1 and drawn[0] == wanted[-1] and drawn[-1] == wanted[0]
            print(f"{job['name']}: drew {drawn} Gaussians, expected {wanted[-1]} first and {wanted[0]} at last; the first "
                  f"picture has {psnr_of(arguments, result['first'], job['name'] + '_first'):.2f} dB"
                  f"{'' if streams else ': FAILED'}")
            bad += not streams
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
