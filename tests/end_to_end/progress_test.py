"""scripts/progress.bash: what a step says while it is at work, and what it leaves.

    progress_test.py SCRIPTS     SCRIPTS: the folder of the scripts
"""
import os, pathlib, pty, re, select, shutil, signal, subprocess, sys, tempfile, time, unittest

helper = pathlib.Path(sys.argv.pop(1)).resolve() / "progress.bash"

STEPS = '''
source "$HELPER"
progress_seconds=1
logs=logs status=mine
mkdir logs
echo "[7/9] of an earlier run" >logs/old.log
build() {
  echo "[0/3] begins" >"$logs/build.log"
  for i in 1 2 3; do echo "[$i/3] Building CXX object x.o" >>logs/build.log; sleep 0.7; done
  echo "built something"
  echo "status is $status"
  return 5
}
tests() {
  echo " 1/20 Test  #4: a.b ...   Passed    0.01 sec" >logs/tests.log
  echo "11/20 Test #14: a.c ...***Failed" >>logs/tests.log
  sleep 1.5
  echo "tested something"
}
plan "dev build" "minutes" build
plan "fast tests" "more minutes" tests
show_plan
step_number=1
watch "logs/*.log" -- build
echo "status $?"
step_number=2
watch "logs/*.log" -- tests
echo "status $?"
'''


class Progress(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        (pathlib.Path(self.folder) / "tmp").mkdir()
        self.environment = dict(os.environ, HELPER=str(helper), TMPDIR=self.folder + "/tmp", TERM="xterm")

    def on_terminal(self, script):
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(self.folder)
            os.execvpe("bash", ["bash", "-c", script], self.environment)
        said, end = "", time.monotonic() + 30
        while time.monotonic() < end:
            if not select.select([terminal], [], [], 0.1)[0]:
                continue
            try:
                said += os.read(terminal, 10000).decode()
            except OSError:  # the other end is closed
                break
        os.waitpid(child, 0)
        os.close(terminal)
        return said

    def assert_order(self, text, *parts):
        """How far a step is at a given second depends on what else the machine does: # stands for a digit."""
        place = 0
        for part in parts:
            found = re.compile(re.escape(part).replace(r"\#", r"\d")).search(text, place)
            self.assertIsNotNone(found, f"{part!r} is not after the others in {text!r}")
            place = found.end()

    def test_without_a_terminal_lines_come_now_and_then(self):
        done = subprocess.run(["bash", "-c", STEPS], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=30)
        self.assertEqual(done.stderr, "")
        self.assert_order(done.stdout, "1  dev build", "minutes", "2  fast tests", "   [1/2] dev build  #/3 built  0:0#\n", "built something\n",
                          "status 5\n", "   [2/2] fast tests  11/20 tests  0:0#\n", "tested something\n", "status 0\n")
        self.assertLessEqual(len(done.stdout.splitlines()), 11, done.stdout)
        self.assertNotIn("7/9", done.stdout)
        self.assertNotIn("\x1b", done.stdout)
        self.assertEqual(os.listdir(self.folder + "/tmp"), [])

    def test_a_terminal_shows_them_in_one_line(self):
        said = self.on_terminal(STEPS)
        self.assert_order(said, "\r\x1b[K[1/2] dev build  #/3 built  0:0#", "\r\x1b[K", "built something\r\n", "status is mine\r\n", "status 5\r\n",
                          "\r\x1b[K[2/2] fast tests  11/20 tests  0:0#", "\r\x1b[K", "tested something\r\n", "status 0\r\n")
        self.assertNotIn("7/9", said)
        self.assertEqual(os.listdir(self.folder + "/tmp"), [])

    def test_nothing_goes_on_after_the_end(self):
        for how in (signal.SIGTERM, None):
            with self.subTest(how=how):
                begun = time.monotonic()
                script = 'source "$HELPER"; plan a b c; step_number=1; watch "*.log" -- sleep ' + ("1" if how is None else "3")
                process = subprocess.Popen(["bash", "-c", script], cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, text=True)
                if how is not None:
                    time.sleep(0.5)
                    process.send_signal(how)
                process.communicate(timeout=15)  # to the end of all that hold its output
                self.assertLess(time.monotonic() - begun, 10)
                self.assertEqual(os.listdir(self.folder + "/tmp"), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
