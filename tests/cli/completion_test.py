"""Completion in bash and zsh: every command, option and choice that --help knows is offered, and files where files are."""

import os
import re
import select
import shutil
import subprocess
import time
import unittest

from support import CommandTest

# Values without a kind of file or a choice: whoever adds an option says there what it takes, or names it here.
FREE = {"--set", "--method", "--shard", "--plot", "--cut"}

DRIVE = """
source completion.bash
complete -p touchfield
COMP_WORDS=(%s)
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
_touchfield
printf '%%s\\n' "${COMPREPLY[@]}"
"""


# The key writes down what is offered, which the function that zsh's own go through sees, and clears the line.
CAPTURE = """
compadd() {
  if [[ ${@[1,(i)(-|--)]} == *-(O|A|D)* ]]; then
    builtin compadd "$@"
    return
  fi
  local -a hits
  builtin compadd -O hits "$@"
  matches+=("${hits[@]}")
  builtin compadd "$@"
}
finish() {
  typeset -ga matches=()
  zle complete
  print -rl -- "${matches[@]}" >next
  mv next offered
  BUFFER=
}
zle -C complete complete-word _main_complete
zle -N finish
bindkey '^I' finish
print ready >next
mv next offered
"""


class CompletionTest(CommandTest):
    """Driven with what `touchfield COMMAND --help` says."""

    def setUp(self):
        super().setUp()
        for shell in ["bash", "zsh"]:
            self.write(f"completion.{shell}", self.run_ok("completion", shell).stdout)
        for name in ["scene.yaml", "other.yml", "run.h5", "skin.stl", "notes.txt"]:
            self.write(name, "")
        (self.folder / "results").mkdir()

    def help_of(self, *command):
        said = self.run_ok(*command, "--help").stdout
        below = re.findall(r"^  ([a-z]+) ", said.partition("\nSubcommands:\n")[2], re.MULTILINE)
        options = re.findall(r"^  (-\S+)(?: (\S[^\n]*?))?(?:  |\n)", said, re.MULTILINE)
        return below, {name: (names, kind or "") for names, kind in options for name in names.split(",")}

    def commands(self):
        """Every command with those below it and its options."""
        found = {}
        rest = [()]
        while rest:
            command = rest.pop()
            found[command] = self.help_of(*command)
            rest += [(*command, name) for name in found[command][0]]
        return found


class Bash(CompletionTest):
    def in_bash(self, *words):
        quoted = " ".join(f"'{word}'" for word in ("touchfield", *words))
        done = subprocess.run(["bash", "--norc", "-c", DRIVE % quoted], cwd=self.folder, capture_output=True, text=True,
                              timeout=60, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""), words)
        registered, *offered = done.stdout.splitlines()
        self.assertEqual(registered, "complete -F _touchfield touchfield")
        return sorted(set(offered) - {""})

    def test_commands_and_options(self):
        commands = self.commands()
        self.assertGreaterEqual(len(commands), 20)
        self.assertIn(("array", "walk"), commands)
        for command, (below, options) in commands.items():
            with self.subTest(command=command):
                self.assertEqual(self.in_bash(*command, "-"), sorted(options))
                self.assertIn("--help", options)
                if below:
                    self.assertEqual(self.in_bash(*command, ""), sorted(below))
                    self.assertEqual(self.in_bash(*command, below[0][:-1]), [below[0]])

    def test_choices(self):
        several = 0
        for command, (_, options) in self.commands().items():
            for name, (_, kind) in options.items():
                with self.subTest(command=command, option=name):
                    offered = self.in_bash(*command, name, "")
                    choices = re.search(r"\{([^}]*)\}", kind)
                    if choices:
                        words = [word.split("->")[0].strip() for word in choices[1].split(",")]
                        self.assertEqual(offered, sorted(words))
                        self.assertEqual(self.in_bash(*command, f"{name}=" if name[1] == "-" else name, words[0][:1])[0][:1],
                                         words[0][:1])
                        several += 1
                    elif "|" in kind:
                        self.assertTrue(offered)
                    elif kind.startswith("TEXT"):
                        self.assertIn(name, FREE, "an option whose value is of no kind")
        self.assertGreater(several, 10)

    def test_words_that_bash_takes_apart(self):
        self.assertEqual(self.in_bash("hand", "--pose", "=", "gra"), ["grasp"])
        self.assertEqual(self.in_bash("hand", "--pose", "="), ["fist", "flat", "grasp", "index_up", "point_down"])
        self.assertEqual(self.in_bash("send", "--to", "autd3", ":"), ["audit", "nop", "remote:", "twincat"])
        self.assertEqual(self.in_bash("send", "--to", "autd3", ":", "tw"), ["twincat"])
        self.assertEqual(self.in_bash("send", "--to", "autd3:tw"), ["twincat"])

    def test_lists_and_values(self):
        self.assertEqual(self.in_bash("study", "--solvers", "lu", "g"), ["gmres"])
        self.assertEqual(self.in_bash("hand", "--pose", "fist", "--forc"), ["--force"])
        self.assertEqual(self.in_bash("array", "test", "--at-mm", "-1", "-2.5", "-3", "--emi"), ["--emit"])
        self.assertEqual(self.in_bash("run", "--set", "a=1", "sc"), ["scene.yaml"])
        self.assertEqual(self.in_bash("mesh", "--cut", ""), [])
        self.assertEqual(self.in_bash("hand", "list", "--p"), ["--pose"])  # another command's word

    def test_files(self):
        self.assertEqual(self.in_bash("run", ""), ["other.yml", "results", "scene.yaml"])
        self.assertEqual(self.in_bash("run", "s"), ["scene.yaml"])
        self.assertEqual(self.in_bash("run", "--from", ""), ["results", "run.h5"])
        self.assertEqual(self.in_bash("run", "-o", ""), ["results"])
        self.assertEqual(self.in_bash("run", "--output", "=", "r"), ["results"])
        self.assertEqual(self.in_bash("compare", "run.h5", "r"), ["results", "run.h5"])
        self.assertEqual(self.in_bash("mesh", "s"), ["skin.stl"])
        self.assertEqual(self.in_bash("mesh", "--unit", "mm", "skin.stl", "-o", "s"), ["skin.stl"])
        self.assertEqual(self.in_bash("compare", "--points", "n"), ["notes.txt"])
        self.assertEqual(self.in_bash("completion", ""), ["bash", "zsh"])
        self.assertEqual(self.in_bash("doctor", ""), [])

    def test_another_shell_is_refused(self):
        done = self.touchfield("completion", "fish")
        self.assertEqual(done.returncode, 2)
        self.assertIn("bash, zsh", done.stderr)


class Zsh(CompletionTest):
    """The same in a shell on a terminal."""

    def setUp(self):
        if not shutil.which("zsh"):
            self.skipTest("zsh is not installed")
        super().setUp()
        self.write("capture.zsh", CAPTURE)
        (self.folder / "functions").mkdir()
        shutil.copy(self.folder / "completion.zsh", self.folder / "functions/_touchfield")

    def start(self, load):
        self.terminal, child = os.openpty()
        environment = {**os.environ, "TERM": "dumb", "PS1": "", "ZDOTDIR": str(self.folder), "COLUMNS": "200"}
        self.shell = subprocess.Popen(["zsh", "-f", "-i"], cwd=self.folder, stdin=child, stdout=child, stderr=child,
                                      env=environment, start_new_session=True)
        os.close(child)
        self.addCleanup(os.close, self.terminal)
        self.addCleanup(self.shell.wait)
        self.addCleanup(self.shell.kill)
        self.send(f"{load}; source ./capture.zsh\n")
        self.assertEqual(self.line(), ["ready"])

    def send(self, text):
        os.write(self.terminal, text.encode())

    def line(self):
        path = self.folder / "offered"
        end = time.monotonic() + 30
        while not path.exists() and time.monotonic() < end:
            if select.select([self.terminal], [], [], 0.01)[0]:
                os.read(self.terminal, 65536)
        text = path.read_text()
        path.unlink()
        return sorted(set(text.split()))

    def in_zsh(self, typed):
        self.send(f"{typed}\t")
        return self.line()

    LOADS = ["fpath=($PWD/functions $fpath); autoload -U compinit; compinit -u -D",
             "autoload -U compinit; compinit -u -D; source completion.zsh"]

    def test_every_command_and_option(self):
        self.start(self.LOADS[0])
        for command, (below, options) in self.commands().items():
            with self.subTest(command=command):
                line = " ".join(["touchfield", *command])
                if below:
                    self.assertEqual(self.in_zsh(f"{line} "), sorted(below))
                self.assertEqual(self.in_zsh(f"{line} -"), sorted(options))

    def test_values(self):
        self.start(self.LOADS[1])
        for typed, offered in [("hand --pose gra", ["grasp"]), ("hand --pose=gra", ["grasp"]), ("study --solvers lu g", ["gmres"]),
                               ("send --to autd3:tw", ["autd3:twincat"]), ("run s", ["scene.yaml"]),
                               ("run --from ", ["functions", "results", "run.h5"]), ("run -o res", ["results"]),
                               ("compare run.h5 r", ["results", "run.h5"]), ("mesh s", ["skin.stl"]),
                               ("completion ", ["bash", "zsh"]), ("array test --at-mm 1 2 3 --emi", ["--emit"]),
                               ("hand --f", ["--force"]), ("hand --force --f", []), ("run --set a=1 --s", ["--set"])]:
            with self.subTest(typed=typed):
                self.assertEqual(self.in_zsh(f"touchfield {typed}"), offered)


if __name__ == "__main__":
    unittest.main()
