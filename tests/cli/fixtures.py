# SPDX-License-Identifier: Apache-2.0
"""Inputs of the command line cases: good models made by gsc itself, and tiny folders as other trainers leave them."""
import io
import json
import os
import pickle
import struct
import subprocess
import shutil
import sys
import types
import zipfile
from array import array
from collections import OrderedDict
from pathlib import Path

import jsonschema

FEATURES, OFFSETS = 32, 10


def _gsc(gsc, *arguments):
    subprocess.run([str(gsc), *map(str, arguments), "-q"], check=True, stdout=subprocess.DEVNULL)


def models(gsc, data):
    """scaffold/ and octree/ (everything on) with their .gsc files."""
    _gsc(gsc, "sample", "room", "--anchors", 3000, "--model", "scaffold", "--seed", 1, "-o", data / "scaffold")
    _gsc(gsc, "sample", "street", "--anchors", 4000, "--model", "octree", "--seed", 2, "--everything-on", "-o",
         data / "octree")
    for name in ("scaffold", "octree"):
        _gsc(gsc, "convert", data / name, "-o", data / f"{name}.gsc")


def small_models(gsc, play, data):
    """Makes the inputs of the tables of command lines: scaffold/ and octree/ of a thousand anchors with their .gsc
    files, the first of one level; damaged.gsc, cut.gsc, future.gsc; path.json with 12 frames, transforms.json;
    sweep.json; run.jsonl, bench.jsonl; note.txt."""
    _gsc(gsc, "sample", "room", "--anchors", 1000, "--seed", 1, "-o", data / "scaffold")
    _gsc(gsc, "sample", "street", "--anchors", 1000, "--model", "octree", "--seed", 2, "-o", data / "octree")
    _gsc(gsc, "sample", "street", "--anchors", 1000, "--model", "octree", "--everything-on", "-o", data / "full")
    for name in ("scaffold", "octree", "full"):
        _gsc(gsc, "convert", data / name, "-o", data / f"{name}.gsc")
    good = (data / "octree.gsc").read_bytes()
    (data / "damaged.gsc").write_bytes(good[:20000] + bytes([good[20000] ^ 1]) + good[20001:])  # in the anchors
    (data / "cut.gsc").write_bytes(good[: len(good) // 2])
    (data / "future.gsc").write_bytes(good[:8] + struct.pack("<H", 9) + good[10:])
    (data / "empty.gsc").write_bytes(b"")
    pose = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "width": 32, "height": 24, "fov_x": 1.2}
    (data / "path.json").write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": [
        {**pose, "position": [0.01 * i, 0, -2]} for i in range(12)]}))
    matrix = [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, -2], [0, 0, 0, 1]]
    (data / "transforms.json").write_text(json.dumps({"camera_angle_x": 1.2, "w": 32, "h": 24, "frames": [
        {"file_path": f"f{i}.png", "transform_matrix": matrix} for i in range(3)]}))
    (data / "sweep.json").write_text(json.dumps({"schema": "gsc.sweep/1", "trajectories": ["path.json"], "frames": 3,
                                                 "runs": [{"policy": "none"}]}))
    (data / "note.txt").write_text("precious\nlines\n")
    (data / "latin.json").write_bytes(b'{"schema": "caf\xe9"}')
    sys.path.insert(0, str(Path(__file__).parents[1] / "chart"))
    import make_runs

    (data / "run.jsonl").write_text("".join(json.dumps(row) + "\n" for row in make_runs.rows(trajectories=1, runs=2,
                                                                                           frames=2)))
    subprocess.run([str(play), "bench", str(data / "octree.gsc"), "--size", "16x16", "--warmup", "0", "--measure", "1",
                    "--backend", "cpu", "--out", str(data / "bench.jsonl"), "-q"], check=True,
                   stdout=subprocess.DEVNULL)


def models_and_few(gsc, data):
    """models() and few.gsc, whose four anchors are too few to derive a metre from."""
    models(gsc, data)
    folder = data / "few" / "point_cloud" / "iteration_30000"
    _ply(folder / "point_cloud.ply", SCAFFOLD)
    _save_archive(folder / "checkpoint.pth", _v1_weights(FEATURES + 4))
    _gsc(gsc, "convert", data / "few", "-o", data / "few.gsc")


def models_and_row(gsc, data):
    """models() and a file with one row of the embedding."""
    models(gsc, data)
    _gsc(gsc, "convert", data / "octree", "-o", data / "octree_row2.gsc", "--appearance", 2)


def _pfm(path, width, height, added):
    """A ramp of colours, `added` to its first pixel."""
    values = array("f", [i % 97 / 128 for i in range(3 * width * height)])
    values[0] += added
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + values.tobytes())


def compared_pictures(gsc, data):
    """vgg16.pth and heads.pth of LPIPS, made up; folders of pictures: right has a and b; other has them too, b changed, and
    c; small has b smaller; one has a alone; twice has a twice; web has right's and files that end as JPEGs of a; none has no
    picture."""
    del gsc
    _save_archive(data / "vgg16.pth", _vgg16())
    shutil.copy(Path(__file__).parents[1] / "input/lpips_heads_legacy.pth", data / "heads.pth")
    for folder, name, width, added in (("right", "a", 24, 0), ("right", "b", 24, 0), ("other", "a", 24, 0),
                                       ("other", "b", 24, 0.5), ("other", "c", 24, 0), ("small", "a", 24, 0),
                                       ("small", "b", 16, 0), ("one", "a", 24, 0), ("twice", "a", 24, 0), ("web", "a", 24, 0),
                                       ("web", "b", 24, 0)):
        _pfm(data / folder / f"{name}.pfm", width, 20, added)
    shutil.copy(data / "twice/a.pfm", data / "twice/a.exr")
    for ending in ("jpg", "JPEG", "webp"):
        (data / f"web/a.{ending}").write_text("not to be read\n")
    (data / "none").mkdir()
    (data / "none/note.txt").write_text("no picture\n")
    (data / "right/note.txt").write_text("no picture\n")


def compared_models(gsc, data):
    """models(), vgg16.pth and heads.pth of LPIPS, made up; where there are trained models fox.gsc and fox8: the same model
    without golden/, with 8-bit pictures where the trainer's render.py would leave them."""
    models(gsc, data)
    _save_archive(data / "vgg16.pth", _vgg16())
    shutil.copy(Path(__file__).parents[1] / "input/lpips_heads_legacy.pth", data / "heads.pth")
    named = os.environ.get("GSC_CHECKPOINTS")
    fox = (Path(named) if named else Path(__file__).parents[2] / "../shared/checkpoints").resolve() / "fox_octree"
    if not fox.is_dir():
        return
    _gsc(gsc, "convert", fox, "-o", data / "fox.gsc")
    renders = data / "fox8/test/ours_10000/renders"
    renders.mkdir(parents=True)
    for name in ("cameras.json", "cfg_args", "point_cloud"):
        (data / "fox8" / name).symlink_to(fox / name)
    for index, name in enumerate(("0001", "0012")):  # the first two test cameras of its cameras.json
        subprocess.run(["oiiotool", fox / "golden" / f"{name}.png", "-d", "uint8", "-o", renders / f"{index:05}.png"],
                       check=True)


def large_model(gsc, data):
    """city/: takes about a second to convert, enough to be interrupted; city.gsc; sweep.json: many runs of it on
    view.json, which has 60 frames; paths/ of that one."""
    _gsc(gsc, "sample", "city", "--anchors", 400_000, "--model", "octree", "--seed", 3, "-o", data / "city")
    _gsc(gsc, "convert", data / "city", "-o", data / "city.gsc")
    frame = {"rotation": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "position": [0, -20, 5], "fov_x": 1.2}
    (data / "paths").mkdir()
    path = {"schema": "gsc.trajectory/1", "frames": [frame | {"position": [i / 10, -20, 5]} for i in range(60)]}
    (data / "paths/view.json").write_text(json.dumps(path))
    (data / "sweep.json").write_text(json.dumps(
        {"schema": "gsc.sweep/1", "trajectories": ["paths/view.json"], "size": [64, 48], "warmup": 0,
         "axes": {"policy": ["error"], "bound": [i / 10 for i in range(1, 5)]}}))


def runs(gsc, data):
    """runs.jsonl: 24 runs on two trajectories; one.jsonl: one of a single frame; broken.jsonl: its second line is cut;
    mixed.jsonl: a run, a line of gsc.play/1 and the run's line again; again.jsonl: that run, measured again;
    unscored.jsonl: its second line has an error but no score; timeless.jsonl: a run of 0 ms. service.jsonl: the trace of a
    service; services.jsonl: two, the second of one worker; indented.json: the first over many lines; halftrace.jsonl: cut."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "chart"))
    import make_runs

    def write(name, lines):
        (data / name).write_text("".join(json.dumps(line) + "\n" for line in lines))

    write("runs.jsonl", make_runs.rows(trajectories=2, runs=12, frames=30, eyes=2))
    schema = Path(__file__).parents[2] / "schemas/run.schema.json"
    if schema.exists():  # what we draw is what a sweep writes
        for line in (data / "runs.jsonl").read_text().splitlines():
            jsonschema.validate(json.loads(line), json.loads(schema.read_text()))
    one = make_runs.rows(trajectories=1, runs=1, frames=1)
    write("one.jsonl", one)
    again = make_runs.rows(trajectories=1, runs=1, frames=1, seed=2)
    again[0]["config"]["id"] = one[0]["config"]["id"]
    write("again.jsonl", again)
    again[0]["accuracy"]["psnr"] = {"pooled": None, "p1": None, "min": None, "min_frame": 0}
    again[0]["accuracy"]["max_error"] = 0.5
    write("unscored.jsonl", [*one, *again])
    again = make_runs.rows(trajectories=1, runs=1, frames=1)
    again[0]["ms"]["wall"]["median"] = 0
    write("timeless.jsonl", again)
    shutil.copy(Path(__file__).parents[2] / "samples/foveation.jsonl", data / "foveation.jsonl")
    curve = {"target_psnr": None, "model_anchors": 9, "most_pixels": 9, "archive_bytes": 9, "worst_pose": "a",
             "detail_ms": {"0": 1, "1": 1, "2": 1, "4": 1}}
    write("curve.jsonl", [line | {"curve": curve} for line in one])
    write("mixed.jsonl", [*one, {"schema": "gsc.play/1"}, *one])
    (data / "broken.jsonl").write_text(json.dumps(one[0]) + "\n" + json.dumps(one[0])[:500] + "\n")
    (data / "other.jsonl").write_text('{"schema": "gsc.play/1"}\n')
    (data / "empty.jsonl").write_text("")
    import make_traces

    traces = [make_traces.trace(seconds=3), make_traces.trace(seconds=2, workers=1)]
    schema = Path(__file__).parents[2] / "schemas/service-trace.schema.json"
    for trace in traces:  # as for runs
        jsonschema.validate(trace, json.loads(schema.read_text()))
    write("service.jsonl", traces[:1])
    write("services.jsonl", traces)
    (data / "indented.json").write_text(json.dumps(traces[0], indent=2))
    (data / "halftrace.jsonl").write_text(json.dumps(traces[0])[:5000] + "}\n")


# ---- PLY


def _columns(*groups):
    names = []
    for group in groups:
        if isinstance(group, tuple):
            names += [f"{group[0]}_{i}" for i in range(group[1])]
        else:
            names.append(group)
    return names


SCAFFOLD = _columns("x", "y", "z", "nx", "ny", "nz", ("f_offset", 3 * OFFSETS), ("f_anchor_feat", FEATURES), "opacity",
                    ("scale", 6), ("rot", 4))


def _ply(path, names, rows=4, header_end="end_header\n", missing_bytes=0):
    path.parent.mkdir(parents=True, exist_ok=True)
    header = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % rows
    header += "".join(f"property float {name}\n" for name in names) + header_end
    values = []
    for row in range(rows):
        for name in names:
            values.append(float(row) if name in "xyz" else 1.0 if name == "rot_0" else 0.0)
    body = struct.pack(f"<{len(values)}f", *values)
    path.write_bytes(header.encode() + body[: len(body) - missing_bytes])


# ---- torch.save archives, without torch


class _FloatStorage:
    def __init__(self, values):
        self.values = values


class _Tensor:
    def __init__(self, shape, values=None):
        self.shape = shape
        count = 1
        for side in shape:
            count *= side
        self.storage = _FloatStorage(values or [0.01 * (i % 7) for i in range(count)])

    def __reduce__(self):
        stride, step = [], 1
        for side in reversed(self.shape):
            stride.insert(0, step)
            step *= side
        return _rebuild_tensor_v2, (self.storage, 0, tuple(self.shape), tuple(stride), False, {})


def _rebuild_tensor_v2(*arguments):
    raise NotImplementedError("only its name goes into the archive")


def _pretend_torch():
    """Modules under torch's names, so that pickle writes these classes under them."""
    storage = type("FloatStorage", (), {"__module__": "torch"})
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")
    torch.FloatStorage, torch._utils, utils._rebuild_tensor_v2 = storage, utils, _rebuild_tensor_v2
    _rebuild_tensor_v2.__module__ = "torch._utils"
    sys.modules.update({"torch": torch, "torch._utils": utils})
    return storage


def _save_archive(path, value):
    storage_class = _pretend_torch()
    storages = []

    class Pickler(pickle.Pickler):
        def persistent_id(self, item):
            if not isinstance(item, _FloatStorage):
                return None
            storages.append(item)
            return ("storage", storage_class, str(len(storages) - 1), "cuda:0", len(item.values))

    buffer = io.BytesIO()
    Pickler(buffer, protocol=2).dump(value)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("archive/data.pkl", buffer.getvalue())
        for key, storage in enumerate(storages):
            archive.writestr(f"archive/data/{key}", array("f", storage.values).tobytes())
        archive.writestr("archive/version", "3\n")


def _state_dict(width, out):
    return OrderedDict([("0.weight", _Tensor([FEATURES, width])), ("0.bias", _Tensor([FEATURES])),
                        ("2.weight", _Tensor([out, FEATURES])), ("2.bias", _Tensor([out]))])


def _v1_weights(width):
    return {"opacity_mlp": _state_dict(width, OFFSETS), "cov_mlp": _state_dict(width, 7 * OFFSETS),
            "color_mlp": _state_dict(width, 3 * OFFSETS)}


def _vgg16():
    layers = [(0, 3, 64), (2, 64, 64), (5, 64, 128), (7, 128, 128), (10, 128, 256), (12, 256, 256), (14, 256, 256),
              (17, 256, 512)] + [(number, 512, 512) for number in (19, 21, 24, 26, 28)]
    pattern = array("f", [(i * 733 % 997 - 498) / 498 for i in range(997)])  # both signs, and no period of the shapes
    tensors = OrderedDict()
    for number, inputs, outputs in layers:
        count, scale = 9 * inputs * outputs, (6 / 9 / inputs) ** 0.5
        scaled = array("f", [value * scale for value in pattern])
        tensors[f"features.{number}.weight"] = _Tensor([outputs, inputs, 3, 3], (scaled * (count // 997 + 1))[:count])
        tensors[f"features.{number}.bias"] = _Tensor([outputs], array("f", [0.0]) * outputs)
    tensors["classifier.0.weight"] = _Tensor([2, 3])  # what LPIPS does not read
    return tensors


class _System:
    """Would run a command if a reader executed what the pickle asks for."""

    def __reduce__(self):
        return os.system, ("touch executed",)


# ---- folders as other trainers leave them


def foreign_models(gsc, data):
    del gsc

    def folder(name):
        path = data / name / "point_cloud" / "iteration_30000"
        path.mkdir(parents=True)
        return path

    _ply(folder("plain_3dgs") / "point_cloud.ply",
         _columns("x", "y", "z", "nx", "ny", "nz", ("f_dc", 3), ("f_rest", 45), "opacity", ("scale", 3), ("rot", 4)))
    _ply(folder("anygs_explicit") / "point_cloud.ply",
         _columns("x", "y", "z", ("f_offset", 3), ("f_dc", 3), ("f_rest", 45), "opacity", ("scale", 6), ("rot", 4)))
    hac = folder("hac")
    _ply(hac / "point_cloud.ply", SCAFFOLD[:36] + [f"f_mask_{i}" for i in range(OFFSETS)] + SCAFFOLD[36:])
    _save_archive(hac / "checkpoint.pth", _v1_weights(FEATURES + 4) | {"grid_mlp": _state_dict(8, 8)})

    gsdf = folder("gsdf_tcnn")
    _ply(gsdf / "point_cloud.ply", SCAFFOLD)
    _save_archive(gsdf / "checkpoint.pth", {"opacity_mlp": _state_dict(FEATURES + 3, OFFSETS),
                                            "cov_mlp": {"params": _Tensor([5120])},
                                            "color_mlp": {"params": _Tensor([4096])},
                                            "anchor_normals_mlp": _state_dict(FEATURES + 3, 3)})
    sogs = folder("sogs")
    _ply(sogs / "point_cloud.ply", SCAFFOLD)
    (sogs / "sogs_config.json").write_text('{"format_version": 2}')
    _save_archive(sogs / "checkpoint.pth", _v1_weights(2 * FEATURES + 3))

    _ply(folder("sibr_crop") / "point_cloud.ply", SCAFFOLD[:-4], header_end="")
    _ply(folder("no_weights") / "point_cloud.ply", SCAFFOLD)
    v1 = folder("truncated_ply")
    _ply(v1 / "point_cloud.ply", SCAFFOLD, missing_bytes=5)
    _save_archive(v1 / "checkpoint.pth", _v1_weights(FEATURES + 4))
    legacy = folder("legacy_pth")
    _ply(legacy / "point_cloud.ply", SCAFFOLD)
    (legacy / "checkpoint.pth").write_bytes(pickle.dumps(0x1950A86A20F9469CFC6C, protocol=2) + b"\x00" * 64)
    evil = folder("evil_pickle")
    _ply(evil / "point_cloud.ply", SCAFFOLD)
    _save_archive(evil / "checkpoint.pth", _v1_weights(FEATURES + 4) | {"extra": _System()})
    wrong = folder("wrong_width")
    _ply(wrong / "point_cloud.ply", SCAFFOLD)
    _save_archive(wrong / "checkpoint.pth", _v1_weights(FEATURES + 17))
    split = folder("rank_split")
    _ply(split / "point_cloud_rk0_ws2.ply", SCAFFOLD)
    _ply(split / "point_cloud_rk1_ws2.ply", SCAFFOLD)
    good = folder("scaffold_v1")
    _ply(good / "point_cloud.ply", SCAFFOLD)
    _save_archive(good / "checkpoint.pth", _v1_weights(FEATURES + 4))
    (data / "empty").mkdir()
    (data / "text.ply").write_text("this is no PLY\n")


if __name__ == "__main__":
    # fixtures.py NAME GSC DIR: makes a fixture by hand
    globals()[sys.argv[1]](Path(sys.argv[2]), Path(sys.argv[3]))
