"""scripts/setup with stubs for apt-get, dpkg-query, sudo, id: nothing is installed here.

    setup_test.py SCRIPTS     SCRIPTS: the folder of the scripts; they are copied first
"""
import os, pathlib, pty, select, shutil, subprocess, sys, tempfile, time, unittest

scripts = pathlib.Path(sys.argv.pop(1)).resolve()

DPKG = '''#!/bin/bash
grep -qxF "${@: -1}" "$STUBS/installed" && echo -n "install ok installed"
'''
APT = '''#!/bin/bash
[ "$2" = --print-uris ] && { echo "0 upgraded, 12 newly installed, 0 to remove and 3 not upgraded."
  echo "Need to get 8,765 kB of archives."; echo "After this operation, 43.2 MB of additional disk space will be used."; exit; }
echo "apt-get $*" >>"$STUBS/calls"
[ "$1" = "$FAILS" ] && exit 100
[ "$1" != install ] || printf '%s\\n' "$@" >>"$STUBS/installed"
'''
SUDO = '''#!/bin/bash
echo "sudo $*" >>"$STUBS/calls"
[ "$1" != -n ] || shift
exec "$@"
'''


class Setup(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        shutil.copytree(scripts, self.folder / "scripts")
        self.stubs = self.folder / "bin"
        self.stubs.mkdir()
        for tool in ("bash", "awk", "grep", "sed", "env", "dirname", "cat", "nproc", "mkdir", "rm", "mktemp", "sleep", "tail", "cut"):
            (self.stubs / tool).symlink_to(shutil.which(tool))
        for name, text in (("dpkg-query", DPKG), ("apt-get", APT), ("sudo", SUDO), ("id", '#!/bin/bash\necho "$FAKE_UID"\n'),
                           ("node", "#!/bin/bash\n"), ("npm", "#!/bin/bash\n")):
            (self.stubs / name).write_text(text)
            (self.stubs / name).chmod(0o755)
        (self.stubs / "installed").touch()
        (self.stubs / "calls").touch()

    def environment(self, uid, fails):
        return {"PATH": str(self.stubs), "STUBS": str(self.stubs), "FAKE_UID": str(uid), "FAILS": fails, "TERM": "dumb", "HOME": str(self.folder)}

    def run_script(self, *words, uid=1000, fails=""):
        """Without a terminal: the exit status and what it said."""
        words = [str(self.folder / "scripts" / words[0]), *words[1:]]
        done = subprocess.run(words, env=self.environment(uid, fails), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=30)
        return done.returncode, done.stdout

    def on_terminal(self, answer, *words, uid=1000):
        """On a terminal, ANSWER typed once it asks: the exit status and what it said."""
        words = [str(self.folder / "scripts" / words[0]), *words[1:]]
        child, terminal = pty.fork()
        if child == 0:
            os.execve(words[0], words, self.environment(uid, ""))
        said, end = "", time.monotonic() + 30
        while time.monotonic() < end:
            if not select.select([terminal], [], [], 0.1)[0]:
                continue
            try:
                read = os.read(terminal, 10000).decode()
            except OSError:  # the other end is closed
                break
            if not read:
                break
            asked = "[y/N]" in said
            said += read
            if not asked and "[y/N]" in said:
                self.assertEqual(self.calls(), "", "installed before it asked")
                os.write(terminal, answer.encode())
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        os.close(terminal)
        return status, said

    def calls(self):
        return (self.stubs / "calls").read_text()

    def assert_nothing_done(self, status, said):
        self.assertEqual(status, 3, said)
        self.assertEqual(self.calls(), "", said)
        self.assertIn("nothing was installed", said)

    def test_a_user_without_a_terminal_is_told_the_command(self):
        status, said = self.run_script("setup")
        self.assert_nothing_done(status, said)
        self.assertIn("sudo apt-get update && sudo apt-get install -y --no-install-recommends git ca-certificates g++", said)
        self.assertIn("--yes", said)
        self.assertIn("12 packages", said)
        self.assertIn("8,765 kB to fetch, 43.2 MB on the disk", said)

    def test_yes_installs_and_a_second_run_has_nothing_to_do(self):
        status, said = self.run_script("setup", "--yes")
        self.assertEqual(status, 0, said)
        self.assertIn("sudo -n apt-get update", self.calls())
        self.assertIn("sudo -n env DEBIAN_FRONTEND=noninteractive apt-get install -y", self.calls())
        done = self.calls()
        self.assertEqual(self.run_script("setup"), (0, "setup: everything is installed.\n"))
        self.assertEqual(self.calls(), done)

    def test_only_what_is_missing_is_installed(self):
        self.run_script("setup", "--yes", "--build-only")
        self.assertNotIn("chromium", self.calls())
        self.assertEqual(self.run_script("setup", "--build-only"), (0, "setup: everything is installed.\n"))
        status, said = self.run_script("setup")
        self.assert_missing(said, there="cmake", missing="chromium")
        self.assertEqual(status, 3)

    def test_the_module_needs_a_compiler_of_its_own(self):
        self.run_script("setup", "--yes", "--wasm")
        for package in ("clang-22", "llvm-22", "lld-22", "wasi-libc", "libeigen3-dev"):
            self.assertIn(f" {package}", self.calls())
        self.assertNotIn("chromium", self.calls())
        self.assertEqual(self.run_script("setup", "--wasm"), (0, "setup: everything is installed.\n"))

    def assert_missing(self, said, there, missing):
        line = next(line for line in said.splitlines() if "missing here:" in line)
        self.assertIn(missing, line.split())
        self.assertNotIn(there, line.split())

    def test_root_without_a_terminal_installs_without_sudo_and_says_so(self):
        status, said = self.run_script("setup", uid=0)
        self.assertEqual(status, 0, said)
        self.assertIn("root without a terminal", said)
        self.assertIn("apt-get install -y", self.calls())
        self.assertNotIn("sudo", self.calls() + said)

    def test_on_a_terminal_yes_installs(self):
        for uid in (1000, 0):
            for answer in ("y\n", "Yes\n"):
                with self.subTest(uid=uid, answer=answer):
                    (self.stubs / "installed").write_text("")
                    (self.stubs / "calls").write_text("")
                    status, said = self.on_terminal(answer, "setup", uid=uid)
                    self.assertEqual(status, 0, said)
                    self.assertIn("[y/N]", said)
                    self.assertIn("apt-get install -y", self.calls())
                    self.assertEqual("sudo" in self.calls(), uid != 0)

    def test_on_a_terminal_all_else_installs_nothing(self):
        for uid in (1000, 0):
            for answer in ("n\n", "\n", "\x04", "yesterday\n"):
                with self.subTest(uid=uid, answer=answer):
                    self.assert_nothing_done(*self.on_terminal(answer, "setup", uid=uid))

    def test_yes_does_not_ask_on_a_terminal(self):
        status, said = self.on_terminal("n\n", "setup", "--yes")
        self.assertEqual(status, 0, said)
        self.assertNotIn("[y/N]", said)

    def test_without_sudo_root_is_told_what_to_run(self):
        (self.stubs / "sudo").unlink()
        for words in (["setup"], ["setup", "--yes"]):
            status, said = self.run_script(*words)
            self.assert_nothing_done(status, said)
            self.assertIn("by: apt-get update && apt-get install", said)

    def test_without_apt_nothing_is_installed_and_that_is_no_failure(self):
        (self.stubs / "apt-get").unlink()
        status, said = self.run_script("setup", "--yes")
        self.assertEqual(status, 0, said)
        self.assertIn("there is no apt-get here", said)

    def test_a_failure_of_apt_is_a_failure(self):
        for fails in ("update", "install"):
            status, said = self.run_script("setup", "--yes", fails=fails)
            self.assertEqual(status, 1, said)
            self.assertIn("failed: sudo apt-get update", said)

    def test_wrong_words_install_nothing(self):
        status, said = self.run_script("setup", "--hurry", "--yes", uid=0)
        self.assertEqual(status, 2)
        self.assertIn("scripts/setup --yes", said)
        self.assertEqual(self.calls(), "")

    def test_steak_and_test_stop_where_setup_was_refused(self):
        for script in ("steak", "test"):
            with self.subTest(script=script):
                status, said = self.run_script(script)
                self.assert_nothing_done(status, said)
                self.assertIn("[1/", said)
                self.assertNotIn("[2/", said)
                self.assertIn("--no-setup", said)
                self.assert_nothing_done(*self.on_terminal("n\n", script))
                self.assertFalse((self.folder / "build").exists())

    def test_steak_and_test_pass_yes_on_or_do_without_setup(self):
        for script in ("steak", "test"):
            with self.subTest(script=script):
                (self.stubs / "installed").write_text("")
                (self.stubs / "calls").write_text("")
                _, said = self.run_script(script, "--no-setup")
                self.assertEqual(self.calls(), "", said)
                self.assertIn("[2/", said)
                _, said = self.run_script(script, "--yes")
                self.assertIn("sudo -n env DEBIAN_FRONTEND=noninteractive apt-get install -y", self.calls())
                self.assertEqual("chromium" in self.calls(), script == "test")
                self.assertIn("[2/", said)


if __name__ == "__main__":
    unittest.main(verbosity=2)
