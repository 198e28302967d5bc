"""scripts/count-tests on what ctest itself writes, whole and ended early.

    count-tests_test.py SCRIPTS     SCRIPTS: the folder of the scripts
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

scripts = pathlib.Path(sys.argv.pop(1)).resolve()

TESTS = """cmake_minimum_required(VERSION 3.20)
project(tests NONE)
enable_testing()
foreach(name good bad skips off late)
  add_test(NAME ${name} COMMAND ${CMAKE_COMMAND} -E $<IF:$<STREQUAL:${name},bad>,false,true>)
endforeach()
set_tests_properties(skips PROPERTIES SKIP_REGULAR_EXPRESSION "^" )
set_tests_properties(off PROPERTIES DISABLED ON)
"""


class CountTests(unittest.TestCase):
    def setUp(self):
        self.logs = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.logs)
        (self.logs / "CMakeLists.txt").write_text(TESTS)
        subprocess.run(["cmake", "-S", self.logs, "-B", self.logs / "build"], check=True, capture_output=True)

    def run_tests(self, name, *which):
        log = subprocess.run(["ctest", "--test-dir", self.logs / "build", "--output-junit", self.logs / f"tests-{name}.xml", *which],
                             capture_output=True, text=True).stdout
        (self.logs / f"tests-{name}.log").write_text(log)

    def ended_early(self, name):
        (self.logs / f"tests-{name}.xml").unlink()
        (self.logs / f"planned-{name}").write_text("7\n")

    def count(self):
        done = subprocess.run([scripts / "count-tests", self.logs, "12"], capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return done.returncode, [line.split(None, 1)[1] for line in done.stdout.splitlines()]

    def test_what_has_results(self):
        self.run_tests("asan")
        status, lines = self.count()
        self.assertEqual(status, 0)
        self.assertEqual(lines, ["3 tests ran, 1 failed, 2 skipped", "3 tests ran, 1 failed, 2 skipped, 0 left out, in 12 s"])

    def test_what_was_ended_early_with_failures(self):
        self.run_tests("asan")
        self.ended_early("asan")
        status, lines = self.count()
        self.assertEqual(status, 1)
        self.assertEqual(lines[0], "3 tests ran, 1 failed, 2 skipped, 2 left out")

    def test_what_was_ended_early_without(self):
        self.run_tests("asan", "-E", "bad")
        self.ended_early("asan")
        status, lines = self.count()
        self.assertEqual(status, 0)
        self.assertEqual(lines[0], "2 tests ran, 0 failed, 2 skipped, 3 left out")


unittest.main()
