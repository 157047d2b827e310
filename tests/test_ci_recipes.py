#!/usr/bin/env -S python3 -B
"""Runs the recipes of docs/ci. Their commands must pass, fail where an image differs, and write what the recipes collect.

They run with this build and small cases. With GLINT_LONG_TESTS=1, as root and with debootstrap and a network, they also run as
they stand, but for the report's cases, in a chroot that the Containerfile's instructions set up.

run_tests: sanitize-long-only"""
import fnmatch
import json
import os
import re
import shlex
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
from pathlib import Path
from xml.etree import ElementTree

from glint import IS_LONG, IS_SANITIZED, PROGRAM, ROOT, SPHERE, TestCase, main, need_device, need_modules, read, write

need_modules("yaml=PyYAML==6.0.3")
import yaml  # noqa: E402

need_device()
# Commands get these here, so that they take seconds.
SMALL = {"verify": "S1 --precision single --lanes 1", "golden": "--lanes 1", "bench": "--size 32x24 --seconds 0.1 --lanes 1 --no-build-times",
         "report": "S1 --precision single --lanes 1"}
MIRROR = os.environ.get("DEBIAN_MIRROR", "http://deb.debian.org/debian")
# Mounts what programs expect, in a namespace that ends with the command.
ENTER = 'mount -t proc proc "$1/proc"; mount -t sysfs sys "$1/sys"; mount --rbind /dev "$1/dev"; exec chroot "$@"'
ENVIRONMENT = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LANG": "C.UTF-8"}


def recipe(name):
    return yaml.load(read(ROOT / "docs/ci" / name), yaml.BaseLoader)


def github():
    """Returns the commands, the command after a failure, and the patterns of the files that are collected."""
    job, = recipe("github.yml")["jobs"].values()
    runs = [step for step in job["steps"] if "run" in step]
    upload, = (step for step in job["steps"] if "upload-artifact" in step.get("uses", ""))
    assert upload["if"] == "always()"
    return ([step["run"] for step in runs if "if" not in step],
            *(step["run"] for step in runs if step.get("if") == "failure()"), upload["with"]["path"].split())


def gitlab():
    """Returns the commands, the last command, which runs in any case and asks for the status, and the collected files."""
    job, = recipe("gitlab.yml").values()
    artifacts = job["artifacts"]
    assert artifacts["when"] == "always" and set(artifacts["reports"]["junit"]) <= set(artifacts["paths"])
    return job["script"], *job["after_script"], artifacts["paths"]


def instructions():
    """Returns the instructions of the Containerfile, as name and arguments."""
    lines = read(ROOT / "docs/ci/Containerfile").splitlines()
    return [line.split(" ", 1) for line in lines if line and not line.startswith("#")]


class Recipes(TestCase):
    def check_recipe(self, shell, folder, commands, after_failure, collected):
        """Runs a recipe for a repository in the folder, where shell(COMMAND, NAME=VALUE…) returns the exit status."""
        self.assertEqual([re.match(r"glint (\w+)", command)[1] for command in commands], ["verify", "golden", "bench"])
        write(folder / "scene.yaml", SPHERE)
        self.assertEqual(shell("glint golden write scene.yaml"), 0)
        committed = set(os.listdir(folder))
        for command in commands:
            self.assertEqual(shell(command), 0, command)
        for name in "verify.xml", "golden.xml":
            suite, = ElementTree.parse(folder / name).getroot()
            self.assertGreater(int(suite.get("tests")), 0)
            self.assertEqual((suite.get("failures"), suite.get("errors")), ("0", "0"))
        self.assertTrue(json.loads(read(folder / "bench.json"))["benchmarks"])

        write(folder / "scene.yaml", SPHERE.replace("radius: 1", "radius: 0.9"))
        self.assertEqual(shell(commands[1]), 3)
        suite, = ElementTree.parse(folder / "golden.xml").getroot()
        self.assertEqual(suite.get("failures"), "1")
        self.assertEqual(shell(after_failure, CI_JOB_STATUS="failed"), 0)
        with tarfile.open(folder / "glint-report.tar.gz") as archive:
            self.assertIn("index.txt", archive.getnames())

        written = set(os.listdir(folder)) - committed
        for pattern in collected:
            self.assertTrue(fnmatch.filter(written, pattern), f"nothing writes {pattern}: {written}")
        self.assertEqual([name for name in written if not any(fnmatch.fnmatch(name, pattern) for pattern in collected)], [])

    def shell_here(self):
        """Runs commands in the current folder, where `glint` adds what makes them small."""
        bin_folder = tempfile.TemporaryDirectory()
        self.addCleanup(bin_folder.cleanup)
        cases = "".join(f'{command}) exec "{PROGRAM}" "$@" {options} ;;\n' for command, options in SMALL.items())
        write(f"{bin_folder.name}/glint", f'#!/bin/sh\ncase $1 in\n{cases}esac\nexit 99\n')
        os.chmod(f"{bin_folder.name}/glint", 0o755)

        def shell(command, **variables):
            environment = {**os.environ, **variables, "PATH": f"{bin_folder.name}:{os.environ['PATH']}"}
            process = subprocess.run(["sh", "-e", "-c", command], env=environment, capture_output=True, text=True)
            if process.returncode != 0:
                print(f"{command}: {process.stderr}", file=sys.stderr)
            return process.returncode

        return shell

    def test_recipes(self):
        """GitLab's recipe passes. GitHub's has the same commands and files."""
        commands, after, collected = github()
        self.assertEqual((commands, collected), (gitlab()[0], gitlab()[2]))
        self.assertIn(f"then {after}; fi", gitlab()[1])
        shell = self.shell_here()
        self.assertEqual(shell(gitlab()[1], CI_JOB_STATUS="success"), 0)
        self.assertEqual(os.listdir(), [])
        self.check_recipe(shell, Path(), *gitlab())

    def test_containerfile_in_a_chroot(self):
        """The instructions install glint in a bare Debian, in which the recipe passes."""
        if not IS_LONG or IS_SANITIZED:
            self.skipTest("GLINT_LONG_TESTS=1 runs the recipes in a chroot")
        if os.geteuid() != 0:
            self.skipTest("only root can make a chroot")
        _, image = instructions()[0]
        suite = re.fullmatch(r"debian:([a-z]+)", image)[1]
        try:
            urllib.request.urlopen(f"{MIRROR}/dists/{suite}/Release", timeout=30).close()
        except OSError as error:
            self.skipTest(f"{MIRROR} cannot be reached: {error}")
        root = Path.cwd() / "root"
        folder = "/"

        def chroot(command, **variables):
            words = ["unshare", "--mount", "--pid", "--fork", "sh", "-ec", ENTER, "sh", root,
                     "sh", "-c", f"cd {shlex.quote(folder)} && {{ {command}\n}}"]
            return subprocess.run(words, env={**ENVIRONMENT, **variables}, stdout=subprocess.DEVNULL).returncode

        for name, rest in instructions():
            if name == "FROM":
                try:
                    process = subprocess.run(["debootstrap", "--variant=minbase", suite, root, MIRROR], stdout=subprocess.DEVNULL)
                except FileNotFoundError:
                    self.skipTest("debootstrap is not installed")
                self.assertEqual(process.returncode, 0)
            elif name == "COPY":
                self.assertRegex(rest, r"^\. /")
                target = f"{root}{rest.split()[1]}"
                os.makedirs(target)
                files = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, check=True).stdout
                archive = subprocess.run(["tar", "-C", ROOT, "-c", "--null", "-T", "-"], input=files, capture_output=True, check=True).stdout
                subprocess.run(["tar", "-C", target, "-x", "--no-same-owner"], input=archive, check=True)
            elif name == "WORKDIR":
                folder = rest
                os.makedirs(f"{root}{folder}", exist_ok=True)
            elif name == "RUN":
                self.assertEqual(chroot(rest), 0, rest)
            else:
                self.assertEqual(name, "CMD")
                self.assertEqual(chroot(shlex.join(json.loads(rest))), 0, rest)
        commands, after, collected = gitlab()
        after = after.replace("glint report", f"glint report {SMALL['report']}")  # all cases would take five minutes
        self.check_recipe(chroot, Path(f"{root}{folder}"), commands, after, collected)


main()
