# SPDX-License-Identifier: Apache-2.0
"""gsc-play xr on the fake OpenXR runtime (fake/), and what OpenXR's poses are as cameras: worked out here once more, so that
a mistake of the player's does not pass as its own reference."""

import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import threading
import time

sys.path.append(str(pathlib.Path(__file__).parents[1] / "support"))
from cases import lavapipe  # noqa: E402

LAYERS = [pathlib.Path(f"{folder}/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json")
          for folder in ("/usr", "/usr/local")]
SECONDS = 120
BACKEND = os.environ.get("GSC_XR_BACKEND", "cpu")


def missing() -> str:
    """Names what the test needs and is not here; empty = all is here."""
    if not any(layer.exists() for layer in LAYERS):
        print("note: no validation layer here, Vulkan's use is not checked; install vulkan-validationlayers")
    return "" if BACKEND != "cpu" or lavapipe() else "no Vulkan driver without a GPU here; install mesa-vulkan-drivers"


def environment(manifest: pathlib.Path | None, settings: pathlib.Path | None) -> dict[str, str]:
    made = {name: value for name, value in os.environ.items()
            if name not in ("XR_RUNTIME_JSON", "GSC_FAKE_XR", "DISPLAY", "WAYLAND_DISPLAY")}
    made["XR_RUNTIME_JSON"] = str(manifest) if manifest else "/nonexistent.json"
    if settings:
        made["GSC_FAKE_XR"] = str(settings)
    if BACKEND == "cpu":
        made["VK_DRIVER_FILES"] = made["VK_ICD_FILENAMES"] = lavapipe()
    if any(layer.exists() for layer in LAYERS):
        made["VK_INSTANCE_LAYERS"] = "VK_LAYER_KHRONOS_validation"
    # driver, loader and layer keep memory until the process ends, which a sanitizer cannot name
    made["ASAN_OPTIONS"] = ":".join(filter(None, [os.environ.get("ASAN_OPTIONS"), "detect_leaks=0"]))
    return made


def single(values: list) -> list:
    """Rounds to single precision, as OpenXR has it: nine digits of that are another number in double precision."""
    return list(struct.unpack(f"{len(values)}f", struct.pack(f"{len(values)}f", *values)))


class Run:
    """One session: what the player said, its log, and what the runtime was given."""

    def __init__(self, folder: pathlib.Path, done: subprocess.CompletedProcess) -> None:
        self.folder, self.code, self.out, self.err = folder, done.returncode, done.stdout, done.stderr
        read = lambda name: [json.loads(line) for line in (folder / name).read_text().splitlines()] \
            if (folder / name).exists() else []  # noqa: E731
        self.log, told = read("log.jsonl"), read("fake.jsonl")
        self.frames = [line for line in told if "views" in line]
        for view in (view for line in self.frames for view in line["views"]):
            view["pose"], view["fov"] = single(view["pose"]), single(view["fov"])
        self.masks = [line for line in told if "visibility_mask" in line]
        self.errors = [line for line in told if "error" in line]
        self.events = [line["event"] for line in told if "event" in line]

    def said(self) -> str:
        return f"exit code {self.code}\n{self.out}\n{self.err}\n" + "\n".join(map(str, self.errors))

    def picture(self, frame: int, view: int) -> bytes:
        """Rows from the top, three bytes a pixel."""
        return (self.folder / f"dump/frame-{frame:05}-view-{view}.ppm").read_bytes().split(b"\n", 3)[3]


class LateTicks:
    """Refreshes that a thread of ordinary priority, which only sleeps until each of them, sees half over: how busy the
    machine is, the player's own drawing counted in."""

    def __init__(self, hz: float) -> None:
        self.late, self._period, self._ends = 0, 1 / hz, threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        due = time.monotonic()
        while not self._ends.is_set():
            due += self._period
            time.sleep(max(due - time.monotonic(), 0))
            behind = time.monotonic() - due
            if behind > self._period / 2:
                self.late += 1 + int(behind / self._period)
                due += int(behind / self._period) * self._period

    def __enter__(self) -> "LateTicks":
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._ends.set()
        self._thread.join()


# --- OpenXR's poses as cameras

def rotation(q: list) -> list[list]:
    """Rows of the matrix that turns by the unit quaternion x, y, z, w."""
    x, y, z, w = (value / math.hypot(*q) for value in q)
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def trajectory(place: dict, views: list[dict], size: tuple[int, int]) -> dict:
    """A camera file of one view that draws what eyes at the poses of `views` see. The lens of the first is that of all."""
    axes = [place["right"], place["up"], place["backward"]]  # of the space, in the world
    world = lambda v: [sum(axes[i][row] * v[i] for i in range(3)) for row in range(3)]  # noqa: E731
    frames = []
    for view in views:
        at, q = view["pose"][:3], view["pose"][3:]
        eye = rotation(q)
        # right, down, forward of the camera are x, -y, -z of the eye
        columns = [world([sign * eye[row][i] for row in range(3)]) for i, sign in ((0, 1), (1, -1), (2, -1))]
        position = [p + place["scale"] * offset for p, offset in zip(place["position"], world(at))]
        frames.append({"rotation": [[columns[i][row] for i in range(3)] for row in range(3)], "position": position,
                       "width": size[0], "height": size[1]})
    left, right, up, down = views[0]["fov"]
    none = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    return {"schema": "gsc.trajectory/1", "frames": frames,
            "views": [{"fov": {"left": left, "right": right, "up": up, "down": down},
                       "pose": {"position": [0, 0, 0], "rotation": none}}]}


# --- headsets

def about_y(degrees: float) -> list:
    return [0, math.sin(math.radians(degrees) / 2), 0, math.cos(math.radians(degrees) / 2)]


def canted(width: int, height: int) -> list[dict]:
    """Two eyes that look outwards by five degrees each, and further outwards than inwards."""
    return [{"fov": [-52, 40, 44, -50], "position": [-0.032, 0, 0.01], "rotation": about_y(5), "width": width, "height": height},
            {"fov": [-40, 52, 44, -50], "position": [0.032, 0, 0.01], "rotation": about_y(-5), "width": width, "height": height}]


def lens(fov: list, size: float, corners: int = 24) -> list[list]:
    """An ellipse's polygon in the middle of a view (left, right, up, down in degrees), `size` of its width and height: right
    and up at depth 1, single precision."""
    left, right, up, down = (math.tan(math.radians(angle)) for angle in fov)
    turn = [2 * math.pi * i / corners for i in range(corners)]
    return [single([(left + right) / 2 + size * (right - left) / 2 * math.cos(a), (up + down) / 2 + size * (up - down) / 2 * math.sin(a)])
            for a in turn]


def hidden_mesh(outline: list[list]) -> dict:
    """Mesh between a polygon around the axis and ten times it, as the fake runtime takes it."""
    count = len(outline)
    far = [[10 * x, 10 * y] for x, y in outline]
    indices = []
    for i in range(count):
        after = (i + 1) % count
        indices += [i, count + i, after, after, count + i, count + after]
    return {"vertices": outline + far, "indices": indices}


def shown_squares(outline: list[list], fov: list, size: tuple[int, int], side: int = 32, margin: int = 2) -> list[tuple[int, int]]:
    """Columns of each row of squares, from the first up to the last that is not hidden with the pixels around it. Angles
    of `fov` are radians."""
    left, right, up, down = map(math.tan, fov)
    width, height = size
    edges = list(zip(outline, outline[1:] + outline[:1]))

    def seen(x: int, y: int) -> bool:
        u, v = left + (x + 0.5) / width * (right - left), up - (y + 0.5) / height * (up - down)
        return all((b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0]) > 0 for a, b in edges)

    pixels = [[seen(x, y) for x in range(width)] for y in range(height)]
    ranges = []
    for top in range(0, height, side):
        rows = pixels[max(top - margin, 0):top + side + margin]
        shown = [i for i, first in enumerate(range(0, width, side))
                 if any(any(row[max(first - margin, 0):first + side + margin]) for row in rows)]
        ranges.append((shown[0], shown[-1] + 1) if shown else (0, 0))
    return ranges


def moving_head(seconds: float) -> list[dict]:
    """Turns, nods and goes forward."""
    keys = []
    for i in range(9):
        t = seconds * i / 8
        yaw, pitch = 0.7 * math.sin(3 * t / seconds), 0.2 * math.cos(5 * t / seconds)
        cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
        keys.append({"t": t, "position": [0.3 * math.sin(t), 0.1 * t, -0.8 * t], "rotation": [cy * sp, sy * cp, -sy * sp, cy * cp]})
    return keys
