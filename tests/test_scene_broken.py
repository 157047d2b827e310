#!/usr/bin/env -S python3 -B
"""Checks that every scene of the tables in tests/broken is refused with exactly the messages next to it, and that every message
has such a scene."""
import os
import re
import shlex
from pathlib import Path

from glint import ROOT, TestCase, main, read, write
from scene_tables import messages_about, messages_in, scenes

TABLES = {path.stem: list(scenes(path)) for path in sorted((ROOT / "tests/broken").glob("*.txt"))}
# tests/test_scene_yaml.c and test_scene_include.c have these messages, without a file or with many.
ELSEWHERE = "a scene and its files may have at most 2 GiB, '' includes itself, a scene may include at most "


class Broken(TestCase):
    def setUp(self):
        super().setUp()
        for name in "README.md", "scenes", "tests":  # that scenes name
            os.symlink(ROOT / name, name)

    def check(self, table, options=""):
        """Checks scenes, by file."""
        process = self.glint(f"check {' '.join(table)} {options}", status=1)
        self.assertEqual(messages_in(process.stderr), [message for file, scene in table.items() for message in messages_about(file, scene)])
        if len(table) > 1:
            self.assertEqual(re.findall(r"(?m)^(.*): \d+ error", process.stdout), list(table))

    def test_tables(self):
        for ending, table in TABLES.items():
            self.assertGreaterEqual(len(table), 30)
            together = {}
            for scene in table:
                name = f"{scene.name}.{ending}"
                Path(name).write_bytes(scene.content)
                if scene.overrides:
                    self.check({name: scene}, " ".join(f"--set {shlex.quote(value)}" for value in scene.overrides))
                else:
                    together[name] = scene
            self.check(together)

    def test_every_message_has_a_scene(self):
        expected = "\n".join([message for table in TABLES.values() for scene in table for message in scene.messages] + [ELSEWHERE])
        sources = "\n".join(read(path) for folder in ("", "yaml") for path in (ROOT / "host/import" / folder).glob("*.c"))
        formats = re.findall(r'(?:report_error\([^;"]*|not_well_formed\[\] = )"([^"]*)"', sources)
        self.assertGreater(len(formats), 40)
        for format in formats:
            longest = max(re.split(r"%[.*0-9z]*.", format), key=len)
            self.assertIn(longest, expected)

    def test_names(self):
        write("scene.txt", "")
        self.refuses("check scene.txt", "scene.txt: the name of a scene must end in .yaml, .yml, .json, .rt, .cfg, .nff, .dat or the ending of a mesh, "
                     "such as .obj, .ply, .stl, .gltf, .glb, .fbx or .dae$")
        self.refuses("check .rt", "^")
        self.refuses("check absent.yml", "absent.yml")


if __name__ == "__main__":
    main()
