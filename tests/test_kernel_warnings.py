#!/usr/bin/env -S python3 -B
"""Checks that the kernels compile without a warning for every single feature and without each one, since PoCL prints warnings
to its user."""
import re
import subprocess
import sys

import glint

sys.path.insert(0, str(glint.ROOT / "tools/kernels"))
import kernel_clang  # noqa: E402

KERNELS = ["render", "aov", "path", "coverage", "trace"] if glint.IS_LONG else ["render"]
PRECISIONS = {"single": [], "strict": ["IS_STRICT"], "double": ["IS_DOUBLE"], "certified": ["IS_CERTIFIED"]}


class KernelWarnings(glint.TestCase):
    def setUp(self):
        super().setUp()
        self.definitions = kernel_clang.scene_definitions(glint.ROOT / "scenes/article.yaml", "single")
        self.features = re.findall(r"#define (HAS_\w+)", self.definitions)
        self.features.remove("HAS_FMA")

    def check(self, name, **values):
        """Compiles the kernels with some of the definitions changed."""
        text = self.definitions
        for key, value in values.items():
            text, count = re.subn(rf"#define {key} .*", f"#define {key} {value}", text)
            self.assertEqual(count, 1, key)
        options = [option for option in kernel_clang.OPTIONS if option != "-w"]
        for kernel in KERNELS:
            source = glint.write("program.cl", f'{text}\n#include "{kernel}.cl"\n')
            process = subprocess.run([f"clang-{CLANG}", *options, "-Werror", "-fsyntax-only", source],
                                     stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual((process.returncode, process.stdout), (0, ""), name)

    def test_no_warnings(self):
        single = [{feature} for feature in self.features]
        others = [set(self.features) - {feature} for feature in self.features]
        for precision, flags in PRECISIONS.items() if glint.IS_LONG else [("single", [])]:
            for lanes, sets in (1, single + others * glint.IS_LONG), (4, others + single * glint.IS_LONG):
                for present in sets:
                    values = {feature: int(feature in present) for feature in self.features}
                    self.check(f"{precision}, {lanes} lanes, {sorted(present)}", LANES=lanes, **values,
                               **dict.fromkeys(flags, 1), IS_COUNTING=len(present) % 2)


if __name__ == "__main__":
    CLANG = glint.need_clang("gpu-resources")
    glint.main()
