#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Outputs of gsc-play: files that exist, links, standard output, full disks, Ctrl-C.

test_play_outputs.py SOURCE_FOLDER GSC_PLAY WRITE_TINY_GSC WRITE_BENCH_REPORT
"""

import json
import os
import resource
import shutil
import signal
import struct
import subprocess
import sys
import time
import unittest

from play_case import PLAY, TRAJECTORY, PlayTest, check_schema, pfm


class PlayOutputsTest(PlayTest):
    def test_existing_files(self) -> None:
        self.small("--out", "a{frame}.pfm")
        keep = (self.folder / "a2.pfm").read_bytes()
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", "--out", "a{frame}.pfm", code=2, says="-w")
        self.assertEqual((self.folder / "a2.pfm").read_bytes(), keep)
        self.small("--out", "a{frame}.pfm", "-w")
        (self.folder / "old.jsonl").write_text("precious")
        self.refused(self.model, "--cameras", self.path, "--size", "48x32", "--stats", "old.jsonl", code=2, says="-w")

    def test_outputs_fall_on_nothing(self) -> None:
        keep = self.model.read_bytes()
        base = (self.model, "--cameras", self.path, "--size", "16x16", "-w")
        self.refused(*base, "--stats", "./model.gsc", code=1, says="--stats would overwrite the model")
        self.refused(*base, "--stats", self.path, code=1, says="--stats would overwrite the camera file")
        self.refused(*base, "--frames", "0:1", "--out", "x.pfm", "--stats", "a/../x.pfm", code=1,
                     says="--stats would overwrite an image of --out")
        (self.folder / "link.pfm").symlink_to(self.model)
        self.refused(*base, "--frames", "0:1", "--out", "link.pfm", code=1, says="overwrite the model")
        os.link(self.model, self.folder / "hard.pfm")
        self.refused(*base, "--frames", "0:1", "--out", "hard.pfm", code=1, says="overwrite the model")
        os.mkfifo(self.folder / "pipe")
        self.refused(*base, "--stats", "pipe", code=2, says="no regular file")
        self.assertEqual(self.model.read_bytes(), keep)

    def test_standard_output(self) -> None:
        base = (self.model, "--cameras", self.path, "--size", "16x16", "--progress", "none")
        run = self.play(*base, "--stats", "-")
        self.assertEqual([json.loads(line)["frame"] for line in run.stdout.splitlines()], [0, 1, 2, 3])
        self.assertIn("4 frames, one eye", run.stderr)
        self.assertEqual(self.play(*base, "--stats", "-", "-q").stderr, "")
        run = self.bench("--measure", "1", "--out", "-")
        check_schema("run", json.loads(run.stdout))
        self.assertIn("frame, wall", run.stderr)
        self.assertFalse((self.folder / "-").exists())
        for arguments in ((*base, "--stats", "-"), ("bench", *base, "--out", "-")):
            error = json.loads(self.play(*arguments, "--format", "json", code=1).stdout)
            check_schema("error", error)
            self.assertIn("(--format)", error["message"])
        self.play(*base, "--stats", "./-")
        self.assertTrue((self.folder / "-").is_file())
        with open("/dev/full", "wb") as full:
            run = subprocess.run([PLAY, *base, "--stats", "-", "--backend", "cpu"], stdout=full, stderr=subprocess.PIPE,
                                 check=False)
        self.assertEqual(run.returncode, 2, run.stderr)

    def stream(self, *arguments: object, code: int = 0) -> bytes:
        run = subprocess.run([PLAY, self.model, "--cameras", self.path, "--backend", "cpu", "-q", "--out", "-",
                              *map(str, arguments)], cwd=self.folder, capture_output=True, check=False)
        self.assertEqual(run.returncode, code, run.stderr)
        return run.stdout

    def test_streams(self) -> None:
        width, height, frames = 23, 16, len(TRAJECTORY["frames"])
        view = ("--size", f"{width}x{height}", "--eyes", "2", "--ipd", "0.1")
        self.play(self.model, "--cameras", self.path, *view, "--out", "s{frame}_{eye}.pfm")
        wanted = []  # of both eyes side by side, as an image file of 8 bits has it
        for frame in range(frames):
            eyes = [pfm(self.folder / f"s{frame}_{eye}.pfm")[2] for eye in ("left", "right")]
            for y in reversed(range(height)):  # a PFM begins at the bottom
                for eye in eyes:
                    wanted += eye[3 * width * y:3 * width * (y + 1)]
        eight = [min(max(int(255 * value + 0.5), 0), 255) for value in wanted]
        self.assertGreater(len(set(eight)), 20)
        self.assertEqual(list(self.stream(*view, "--stream", "rgb24")), eight)
        rgb48 = struct.unpack(f"<{len(wanted)}H", self.stream(*view, "--stream", "rgb48"))
        self.assertLessEqual(max(abs(65535 * min(max(a, 0), 1) - b) for a, b in zip(wanted, rgb48)), 0.51)

        y4m = self.stream(*view, "--fps", "29.97")
        header, rest = y4m.split(b"\n", 1)
        self.assertEqual(header, f"YUV4MPEG2 W{2 * width} H{height} F30000:1001 Ip A1:1 C444p16 XCOLORRANGE=FULL".encode())
        pixels, decoded = 2 * width * height, []
        for _ in range(frames):
            self.assertEqual(rest[:6], b"FRAME\n")
            planes = struct.unpack(f"<{3 * pixels}H", rest[6:6 + 6 * pixels])
            rest = rest[6 + 6 * pixels:]
            for luma, u, v in zip(planes, planes[pixels:], planes[2 * pixels:]):
                red, blue = luma + 1.402 * (v - 32768), luma + 1.772 * (u - 32768)
                green = (luma - 0.299 * red - 0.114 * blue) / 0.587
                decoded += [round(value / 257) for value in (red, green, blue)]
        self.assertEqual(rest, b"")
        self.assertEqual(decoded, eight)
        self.assertIn(b"F24000:1000 ", self.stream("--size", "8x8", "--frames", "0:1", "--fps", "24"))

    def test_streams_refused(self) -> None:
        base = (self.model, "--cameras", self.path, "--out", "-")
        self.refused(*base, "--size", "8x8", "--stats", "-", code=1, says="--stats -")
        self.refused(*base, "--size", "8x8", "--depth", "16", code=1, says="--depth")
        self.refused(*base, "--size", "8x8", "--stream", "rgb24", "--fps", "24", code=1, says="--fps")
        self.refused(*base, "--size", "8x8", "--shard", "1/2", "--stats", "s.jsonl", code=1, says="--shard 1/2")
        self.refused(self.model, "--stream", "rgb24", code=1, says="--stream")
        error = json.loads(self.play(*base, "--size", "8x8", "--format", "json", code=1).stdout)
        check_schema("error", error)
        trajectory = json.loads(self.path.read_text())
        for i, frame in enumerate(trajectory["frames"]):
            frame.update(width=20 + 2 * (i // 3), height=10)
        self.path.write_text(json.dumps(trajectory))
        self.refused(*base, code=1, says="choose one --size")

    def test_stream_whose_reader_ends(self) -> None:
        frames = TRAJECTORY["frames"][:1] * 200
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        run = subprocess.Popen([PLAY, self.model, "--cameras", self.path, "--size", "320x200", "--backend", "cpu", "--out",
                                "-", "--stats", "s.jsonl", "-q"], cwd=self.folder, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE)
        self.assertEqual(run.stdout.read(9), b"YUV4MPEG2")
        run.stdout.close()
        told = run.stderr.read().decode()
        run.stderr.close()
        self.assertEqual(run.wait(60), 2, told)
        self.assertIn("has ended", told)
        self.assertEqual([p.name for p in self.folder.iterdir() if "s.jsonl" in p.name], [])

    def video(self, program: str, *arguments: object, code: int = 0) -> str:
        """With a folder of its own in PATH, where `program` is the script that ffmpeg is, if there is one."""
        folder = self.folder / "bin"
        folder.mkdir(exist_ok=True)
        if program:
            (folder / "ffmpeg").write_text(f"#!/bin/sh\n{program}\n")
            (folder / "ffmpeg").chmod(0o755)
        run = subprocess.run([PLAY, self.model, "--cameras", self.path, "--backend", "cpu", "-q", "--video", "v.mp4",
                              *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, check=False,
                             env={**os.environ, "PATH": str(folder)})
        self.assertEqual(run.returncode, code, run.stderr)
        return run.stderr

    def test_video_fails(self) -> None:
        big = ("--size", "640x400")
        self.assertIn("no ffmpeg in PATH", self.video("", *big, code=5))
        for program in ("echo 'Unknown encoder' >&2; exit 3", "exec </dev/null; echo 'Unknown encoder' >&2; kill -9 $$"):
            self.assertIn("Unknown encoder", self.video(program, *big, code=2))
        # reads all, and then fails; says nothing; ends well without reading
        self.assertIn("No space left", self.video("/bin/cat >/dev/null; echo 'No space left' >&2; exit 1", *big, code=2))
        self.assertIn("it said nothing", self.video("exit 1", *big, code=2))
        self.video("exit 0", *big, code=2)
        # the program gets signals as they were, not ignored as they are here: 128 + SIGPIPE
        self.assertIn("exit code 141", self.video("kill -PIPE $$; exit 3", *big, code=2))
        self.assertEqual([p.name for p in self.folder.iterdir() if "v.mp4" in p.name], [])
        (self.folder / "v.mp4").write_text("precious")
        self.assertIn("-w", self.video("exit 0", *big, code=2))
        self.video("exit 1", *big, "-w", code=2)
        self.assertEqual((self.folder / "v.mp4").read_text(), "precious")
        (self.folder / "v.mp4").unlink()
        (self.folder / "model.mp4").symlink_to(self.model)
        self.refused(self.model, "--size", "8x8", "--video", "model.mp4", "-w", code=1, says="overwrite the model")

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_video(self) -> None:
        # small pictures of this model are of colours that change from pixel to pixel, which 4:2:0 cannot show
        for size, eyes, least in (((160, 120), 2, 26), ((33, 31), 1, 19), ((33, 31), 2, 19), ((40, 31), 1, 19),
                                  ((33, 30), 1, 19), ((1, 1), 1, 19)):
            width, height = size[0] * eyes, size[1]
            even = (width + width % 2, height + height % 2)
            view = ("--size", f"{size[0]}x{size[1]}", "--eyes", eyes, *(("--ipd", "0.1") if eyes == 2 else ()))
            run = self.play(self.model, "--cameras", self.path, *map(str, view), "--video", "v.mp4", "--fps", "12", "-w",
                            "--format", "json")
            report = json.loads(run.stdout)
            check_schema("play-report", report)
            self.assertEqual((report["video"], report["images"]), ("v.mp4", []))
            # what browsers play: 4:2:0 of even sides, the added row and column a copy of the last
            shape = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=codec_name,pix_fmt,width,height",
                                    "-of", "csv=p=0", "v.mp4"], cwd=self.folder, capture_output=True, text=True, check=True)
            self.assertEqual(shape.stdout.strip(), f"h264,{even[0]},{even[1]},yuv420p")
            self.assertEqual(even != (width, height), f"the video has {even[0]} x {even[1]}" in run.stderr, run.stderr)
            grey = subprocess.run(["ffmpeg", "-v", "error", "-i", "v.mp4", "-f", "rawvideo", "-pix_fmt", "gray", "-"],
                                  cwd=self.folder, capture_output=True, check=True).stdout
            last = [(grey[y * even[0] + width - 1], grey[y * even[0] + even[0] - 1]) for y in range(height)]
            last += [(grey[(height - 1) * even[0] + x], grey[(even[1] - 1) * even[0] + x]) for x in range(width)]
            self.assertLess(sum(abs(a - b) for a, b in last) / len(last), 4, size)
            decoded = subprocess.run(["ffmpeg", "-v", "error", "-i", "v.mp4", "-vf", f"crop={width}:{height}:0:0:exact=1",
                                      "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
                                     cwd=self.folder, capture_output=True, check=True).stdout
            wanted = self.stream(*view, "--stream", "rgb24")
            self.assertEqual(len(decoded), len(wanted))
            one = 3 * width * height
            for frame in range(len(TRAJECTORY["frames"])):  # none lost, doubled or in another's place
                squares = [sum((a - b) ** 2 for a, b in zip(decoded[one * frame:one * (frame + 1)],
                                                            wanted[one * other:one * (other + 1)])) / one
                           for other in range(len(TRAJECTORY["frames"]))]
                self.assertEqual(min(squares), squares[frame], (size, frame))
                self.assertLess(squares[frame], 255 ** 2 / 10 ** (least / 10), (size, frame))
        self.assertEqual(sorted(p.name for p in self.folder.iterdir() if "v.mp4" in p.name), ["v.mp4"])

    def closed(self, streams: str, *arguments: str) -> int:
        """Exit code where standard streams are closed at the start."""
        return subprocess.run(["sh", "-c", f'exec "$0" "$@" {streams}', PLAY, self.model, "--cameras", self.path,
                               "--backend", "cpu", "--size", "160x120", *arguments], cwd=self.folder, check=False).returncode

    def test_closed_streams(self) -> None:
        # no file of a run may take the place of a stream, or what is printed would be in it
        files = ["--out", "{name}.pfm", "--stats", "s.jsonl", "--progress", "json", "-w"]
        if shutil.which("ffmpeg"):
            files += ["--video", "v.mp4"]
        self.assertEqual(self.closed(">/dev/null 2>&1", *files), 0)
        wanted = {p.name: p.read_bytes() for p in self.folder.iterdir() if p.suffix in (".pfm", ".mp4")}
        for streams, code in (("<&- >/dev/null 2>&1", 0), (">&- 2>/dev/null", 2), ("2>&- >/dev/null", 0),
                              ("<&- 2>&- >/dev/null", 0), (">&- 2>&-", 2), ("<&- >&- 2>&-", 2)):
            with self.subTest(streams):
                self.assertEqual(self.closed(streams, *files), code)
                for name, content in wanted.items():
                    self.assertEqual((self.folder / name).read_bytes(), content, name)
                for line in (self.folder / "s.jsonl").read_text().splitlines():
                    check_schema("frame-stats", json.loads(line))

    def test_ignored_signals(self) -> None:
        # what was started with a signal ignored goes on at it (nohup, `command &`), and ends at one that is not
        frames = TRAJECTORY["frames"][:1] * 100000
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        requests = (signal.SIGINT, signal.SIGHUP, signal.SIGTERM)
        for number in (*requests, signal.SIGQUIT):
            with self.subTest(number):
                shutil.rmtree(self.folder / "o", ignore_errors=True)
                run = subprocess.Popen([PLAY, self.model, "--cameras", self.path, "--backend", "cpu", "--size", "32x20",
                                        "--out", "o/{frame}.pfm", "-q"], cwd=self.folder, stderr=subprocess.PIPE,
                                       preexec_fn=lambda: signal.signal(number, signal.SIG_IGN))
                try:
                    self.written(3)
                    run.send_signal(number)
                    self.written(len(list((self.folder / "o").iterdir())) + 20)
                    self.assertIsNone(run.poll())
                    run.send_signal(next(other for other in requests if other != number))
                    run.send_signal(number)  # still ignored: no second signal that kills
                    stderr = run.communicate(timeout=60)[1]
                finally:
                    run.kill()
                self.assertEqual(run.returncode, 130, stderr)
                self.assertIn(b"all complete", stderr)

    def written(self, images: int) -> None:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if (self.folder / "o").exists() and len(list((self.folder / "o").iterdir())) >= images:
                return
            time.sleep(0.01)
        self.fail(f"there never were {images} images")

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_signals_of_a_video(self) -> None:
        # Ctrl-C of a terminal reaches the whole group: the encoder must not end by itself before its input does
        frames = TRAJECTORY["frames"][:1] * 100000
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        for ignored, code in ((False, 130), (True, None)):
            with self.subTest(ignored=ignored):
                run = subprocess.Popen([PLAY, self.model, "--cameras", self.path, "--backend", "cpu", "--size", "64x48",
                                        "--video", "v.mp4", "--progress", "json"], cwd=self.folder, stderr=subprocess.PIPE,
                                       start_new_session=True,
                                       preexec_fn=lambda: ignored and signal.signal(signal.SIGINT, signal.SIG_IGN))
                try:
                    self.assertIn(b"progress", next(line for line in run.stderr if b'"progress"' in line))
                    os.killpg(run.pid, signal.SIGINT)
                    if ignored:
                        for _ in range(3):
                            self.assertIn(b'"progress"', run.stderr.readline())
                        os.killpg(run.pid, signal.SIGTERM)
                    stderr = run.communicate(timeout=60)[1]
                finally:
                    run.kill()
                self.assertEqual(run.returncode, 130, stderr)
                self.assertIn(b"interrupted: stopped after", stderr)
                self.assertEqual([p.name for p in self.folder.iterdir() if "v.mp4" in p.name], [])

    def test_links_and_modes(self) -> None:
        (self.folder / "data").mkdir()
        (self.folder / "s.jsonl").symlink_to("data/s.jsonl")
        (self.folder / "a0.pfm").symlink_to("data/a.pfm")
        self.small("--frames", "0:1", "--stats", "s.jsonl", "--out", "a{frame}.pfm")
        for name, target in (("s.jsonl", "data/s.jsonl"), ("a0.pfm", "data/a.pfm")):
            self.assertEqual(os.readlink(self.folder / name), target)
            (self.folder / target).chmod(0o600)
        self.small("--frames", "0:1", "--stats", "s.jsonl", "--out", "a{frame}.pfm", "-w")
        self.assertEqual([(path.name, path.stat().st_mode & 0o777) for path in sorted((self.folder / "data").iterdir())],
                         [("a.pfm", 0o600), ("s.jsonl", 0o600)])

    def test_names_that_are_not_utf8(self) -> None:
        model = os.fsencode(self.folder) + b"/\xff\x80.gsc"
        run = subprocess.run([PLAY, model, "--format", "json", "--backend", "cpu"], capture_output=True, check=False)
        self.assertEqual(run.returncode, 2)
        check_schema("error", json.loads(run.stdout.decode()))
        self.assertIn("\ufffd\ufffd.gsc", run.stderr.decode())
        os.rename(self.model, model)
        run = subprocess.run([PLAY, model, "--size", "8x8", "--format", "json", "--backend", "cpu", "-q", "--stats",
                              model + b".jsonl"], capture_output=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        check_schema("play-report", json.loads(run.stdout.decode()))
        self.assertTrue(os.path.exists(model + b".jsonl"))

    def test_file_size_limit(self) -> None:
        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

        for name in ("a.pfm", "a.png"):
            run = subprocess.run([PLAY, self.model, "--size", "200x200", "--frames", "0:1", "--out", name, "-q"],
                                 cwd=self.folder, capture_output=True, preexec_fn=limit, check=False)
            if run.returncode != 5:  # a build without PNG
                self.assertEqual(run.returncode, 2, run.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if "tmp" in p.name], [])

    def test_names_stay_in_the_folder(self) -> None:
        trajectory = json.loads(self.path.read_text())
        trajectory["frames"] = trajectory["frames"][:1]
        trajectory["frames"][0]["name"] = "../../escape/x"
        self.path.write_text(json.dumps(trajectory))
        self.small("--out", "o/{name}.pfm")
        self.assertEqual([p.name for p in (self.folder / "o").iterdir()], ["_._.._escape_x.pfm"])

    def test_unwritable_places(self) -> None:
        (self.folder / "file").write_text("")
        self.small("--out", "file/{frame}.pfm", code=2)
        self.small("--stats", self.folder, "-w", code=2)

    def test_full_disk(self) -> None:
        if not os.path.exists("/dev/full"):
            self.skipTest("no /dev/full")
        with open("/dev/full", "wb") as full:
            run = subprocess.run([PLAY, self.model, "--size", "8x8", "-q", "--format", "json"], stdout=full, stderr=subprocess.PIPE,
                                 check=False)
        self.assertEqual(run.returncode, 2)

    def test_interrupt_leaves_whole_files(self) -> None:
        for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
            with self.subTest(number):
                self.interrupt(number)
                shutil.rmtree(self.folder / "o")

    def interrupt(self, number: int) -> None:
        frames = TRAJECTORY["frames"][:1] * 2000
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        run = subprocess.Popen(
            [PLAY, self.model, "--cameras", self.path, "--size", "320x200", "--out", "o/{frame}.pfm", "--stats",
             "s.jsonl", "-q"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        out = self.folder / "o"
        deadline = time.monotonic() + 60
        while not (out / "3.pfm").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        run.send_signal(number)
        stdout, stderr = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 130, stderr)
        self.assertEqual(stdout, b"")
        self.assertFalse((self.folder / "s.jsonl").exists())
        self.assertEqual([p.name for p in self.folder.iterdir() if "tmp" in p.name], [])
        images = list(out.iterdir())
        self.assertGreater(len(images), 3)
        self.assertIn(f"{len(images)} images written, all complete".encode(), stderr)
        for image in images:
            self.assertEqual(image.suffix, ".pfm")
            self.assertEqual(pfm(image)[:2], (320, 200))

    def test_image_that_appears_meanwhile_is_kept(self) -> None:
        frames = TRAJECTORY["frames"][:1] * 200
        self.path.write_text(json.dumps({"schema": "gsc.trajectory/1", "frames": frames}))
        run = subprocess.Popen([PLAY, self.model, "--cameras", self.path, "--size", "160x100", "--out", "o/{frame}.pfm",
                                "--backend", "cpu", "-q"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        out = self.folder / "o"
        deadline = time.monotonic() + 60
        while not (out / "0.pfm").exists() and time.monotonic() < deadline:
            time.sleep(0.001)
        run.send_signal(signal.SIGSTOP)
        self.assertFalse((out / "199.pfm").exists())
        (out / "199.pfm").write_text("precious")
        run.send_signal(signal.SIGCONT)
        stderr = run.communicate(timeout=60)[1]
        self.assertEqual(run.returncode, 2, stderr)
        self.assertIn("199.pfm: already exists", stderr)
        self.assertEqual((out / "199.pfm").read_text(), "precious")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
