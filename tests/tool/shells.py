# SPDX-License-Identifier: Apache-2.0
"""Shells that tell what they offer for a line: bash and fish by their own functions, bash and zsh in a terminal.

offers(line) returns {word: what is said of it}. A word is what a user would see: the name of a file without its folder,
a value without the option before it.
"""

import fcntl
import os
import pty
import re
import select
import shlex
import signal
import struct
import subprocess
import termios
import time

PATIENCE = 60  # seconds; a program under a sanitizer starts slowly


def seen(word: str) -> str:
    word = re.sub(r"\\(.)", r"\1", word)
    word = re.sub(r"^--[^=]*=", "", word)
    return word.rstrip("/").rpartition("/")[2]


class Bash:
    """Without a terminal: the variables that bash sets are set here."""

    # the words as bash cuts them, of which quotes do not come here
    SCRIPT = r"""
        COMP_LINE=$2 COMP_POINT=${#2} COMP_WORDS=($2) COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
        set -- "$(complete -p "${COMP_WORDS[0]##*/}")"
        set -- ${1#*-F }
        "$1"
        printf '%s\n' "${COMPREPLY[@]}"
    """

    def __init__(self, scripts, folder, environment):
        self.folder, self.environment = folder, environment
        self.source = "".join(f"source '{path}'\n" for path in scripts["bash"])

    def offers(self, line: str) -> dict:
        text = subprocess.run(["bash", "--norc", "--noprofile", "-c", self.source + self.SCRIPT, "bash", "-", line],
                              cwd=self.folder, env=self.environment, capture_output=True, text=True, check=True)
        if text.stderr:
            raise AssertionError(text.stderr)
        return {seen(word): "" for word in text.stdout.splitlines() if word}


class Fish:
    def __init__(self, scripts, folder, environment):
        self.folder, self.environment = folder, environment
        self.source = "".join(f"source '{path}'\n" for path in scripts["fish"])

    def complete(self, line: str) -> list:
        text = subprocess.run(["fish", "--no-config", "-c", self.source + "complete -C $argv[1]", line],
                              cwd=self.folder, env=self.environment, capture_output=True, text=True, check=True)
        if text.stderr:
            raise AssertionError(text.stderr)
        return [line.partition("\t")[::2] for line in text.stdout.splitlines()]

    def offers(self, line: str) -> dict:
        return {seen(word): said for word, said in self.complete(line)}


class Terminal:
    """A shell at a prompt. A key ends each case: it prints the line as it has become and empties it."""

    def __init__(self, command, setup, folder, environment):
        self.process, self.screen = pty.fork()
        if self.process == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, environment | {"TERM": "vt100"})
        fcntl.ioctl(self.screen, termios.TIOCSWINSZ, struct.pack("HHHH", 200, 200, 0, 0))
        os.write(self.screen, setup.encode() + b"\nprintf 'IS%s\\n' READY\n")
        self.until(r"ISREADY.*?> ")

    def until(self, pattern: str) -> str:
        text, end = "", time.monotonic() + PATIENCE
        while not (found := re.search(pattern, text, re.DOTALL)):
            if not select.select([self.screen], [], [], max(0, end - time.monotonic()))[0]:
                raise AssertionError(f"no {pattern!r} within {PATIENCE} s in {text!r}")
            try:
                text += os.read(self.screen, 65536).decode(errors="replace").replace("\r", "")
            except OSError:
                raise AssertionError(f"the shell has ended: {text!r}") from None
            text = re.sub(r"\x1b(\[[?0-9;]*[A-Za-z]|[=>])|\x1b\([AB0]|[\x00\x07\x0f]", "", text)
        return text[: found.end()]

    def typed(self, line: str) -> tuple:
        """The line after TAB, and what is listed below it."""
        os.write(self.screen, line.encode() + b"\t\x18\x10")
        # to the next prompt: before it zsh leaves the terminal as it was, which would show what comes as it is typed
        shown, _, rest = self.until(r"LINE\[.*?\]END.*?> ").partition("LINE[")
        return rest[: rest.rindex("]END")], shown.split("\n")[1:]

    def offers(self, line: str) -> dict:
        """Listed where there are several; the only one is put into the line."""
        after, listed = self.typed(line)
        found = {}
        for row in listed:
            names, _, said = row.partition(" -- ")
            for name in re.split(r"\s{2,}", names.strip()):
                if name and not name.startswith(">"):
                    found[seen(name)] = said.strip()
        if not found and after.rstrip() != line.rstrip():
            found[seen(shlex.split(after)[-1])] = ""
        return found

    def close(self) -> None:
        os.close(self.screen)
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)


def bash_terminal(scripts, folder, environment) -> Terminal:
    setup = "".join(f"source '{path}'\n" for path in scripts["bash"]) + r"""
        PS1='> ' PS2=
        bind 'set show-all-if-ambiguous on'; bind 'set bell-style none'; bind 'set page-completions off'
        bind 'set completion-query-items 0'; bind 'set enable-bracketed-paste off'
        tell() { printf 'LINE[%s]%s\n' "$READLINE_LINE" END; READLINE_LINE=; READLINE_POINT=0; }
        bind -x '"\C-x\C-p": tell'
    """
    return Terminal(["bash", "--norc", "--noprofile", "-i"], setup, folder, environment)


def zsh_terminal(scripts, folder, environment, sourced=False) -> Terminal:
    """The scripts lie in fpath, as where they are installed, or are read by `source`."""
    start = "autoload -Uz compinit && compinit -D -u\n"
    if sourced:
        setup = start + "".join(f"source '{path}'\n" for path in scripts["zsh"])
    else:
        setup = f"fpath=('{os.path.dirname(scripts['zsh'][0])}' $fpath)\n{start}"
    setup += r"""
        PS1='> ' PS2= LISTMAX=0
        setopt no_list_ambiguous no_always_last_prompt no_beep no_list_types
        tell() { zle -I; print -r -- "LINE[$BUFFER]""END"; BUFFER=; }
        zle -N tell
        bindkey '^X^P' tell
    """
    return Terminal(["zsh", "-f", "-i"], setup, folder, environment)
