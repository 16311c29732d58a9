"""systemd/examples/gatewayd-mappings with repositories, remotes and settings that are wrong or meant to harm."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from contextlib import suppress
from pathlib import Path

import pytest

from tests.e2e.processes import HOST, free_port
from tests.fleet.site import Site, needs_git
from tests.fleet.stub import GATEWAYD

pytestmark = needs_git


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """With one version in place, served by a stand-in for gatewayd."""
    found = Site(tmp_path, GATEWAYD)
    found.commit({"press.yaml": "one"})
    found.served()
    return found


def tree_with(site: Site, line: bytes) -> None:
    """Commit a directory with an entry that nobody could commit from files, as `git mktree` reads it."""
    tree = site.git("mktree", "-z", text=line + b"\0")
    site.git("read-tree", "--empty")
    site.git("read-tree", "--prefix=cells/press", tree)
    site.git("commit", "--quiet", "-m", "hostile")


def is_untouched(site: Site) -> bool:
    return site.files() == {"press.yaml": "one"} and not (site.state / "pending").exists()


def test_a_link_is_refused(site: Site) -> None:
    (site.work / "cells/press/secret.yaml").symlink_to("/etc/shadow")
    site.commit({})
    assert "secret.yaml is no plain file (mode 120000)" in site.refused()
    assert is_untouched(site)


def test_a_linked_repository_is_refused(site: Site) -> None:
    commit = site.git("rev-parse", "HEAD")
    tree_with(site, b"160000 commit " + commit.encode() + b"\tother.yaml")
    assert "other.yaml is no plain file (mode 160000)" in site.refused()
    assert is_untouched(site)


@pytest.mark.parametrize(
    "name",
    [
        b"a b.yaml",
        b"-rf.yaml",
        b"$(id).yaml",
        b"a\nb.yaml",
        b"\xff\xfe.yaml",
        b"a\tb.yaml",
        b"sub/-x.yaml",
        b"*.yaml",
    ],
)
def test_a_name_that_a_shell_or_a_screen_would_take_for_something_else(site: Site, name: bytes) -> None:
    path = os.fsencode(site.work / "cells/press") + b"/" + name
    Path(os.fsdecode(path)).parent.mkdir(exist_ok=True)
    Path(os.fsdecode(path)).write_text("x")
    site.commit({})
    said = site.refused()
    assert "has other characters" in said
    assert "\xff" not in said
    assert is_untouched(site)


@pytest.mark.parametrize("name", [b"..", b".git", b"a/../../../escape"])
def test_a_name_that_leads_out_does_not_even_arrive(site: Site, name: bytes) -> None:
    blob = site.git("hash-object", "-w", "--stdin", text="x")
    raw = b"100644 " + name + b"\0" + bytes.fromhex(blob)
    inner = site.git("hash-object", "-w", "-t", "tree", "--stdin", "--literally", text=raw)
    cells = site.git("mktree", text=f"040000 tree {inner}\tpress\n")
    root = site.git("mktree", text=f"040000 tree {cells}\tcells\n")
    commit = site.git("commit-tree", root, "-p", "HEAD", "-m", "hostile")
    site.git("update-ref", "refs/heads/main", commit)
    site.refused(code=75)
    assert is_untouched(site)


def test_hidden_files_are_left_out_and_directories_come_along(site: Site) -> None:
    site.commit({".gitlab-ci.yml": "x", "sheets/drive.eds": "sheet", "sheets/.hidden": "x"})
    site.served()
    assert site.files() == {"press.yaml": "one", "sheets/drive.eds": "sheet"}


def test_a_file_that_is_too_large(site: Site) -> None:
    site.commit({"press.yaml": "#" * (1 << 20) + "\n"})
    assert "more than 1048576" in site.refused()
    assert is_untouched(site)


def test_too_many_files(site: Site) -> None:
    site.commit({f"n{number}.yaml": "x" for number in range(257)})
    assert "more than 256 files" in site.refused()
    assert is_untouched(site)


def test_a_repository_that_would_fill_the_disk(site: Site) -> None:
    """No file larger than the limit is written (here 1 MB instead of 64), and what had been is gone by the next run."""
    (site.work / "noise.bin").write_bytes(os.urandom(3 << 20))
    site.commit({})
    assert site.run(before=["prlimit", f"--fsize={1 << 20}"]).returncode == 75
    assert is_untouched(site)
    site.git("reset", "--quiet", "--hard", "HEAD~1")
    site.served()
    assert sum(path.stat().st_size for path in site.state.rglob("*") if path.is_file()) < 1 << 20


def test_a_filter_and_a_hook_of_the_repository_are_not_run(site: Site) -> None:
    site.commit(
        {"../../.gitattributes": "* filter=evil text eol=crlf export-subst\n", "press.yaml": "$Format:%H$\n"}
    )
    hooks = site.state / "repository.git/hooks"
    hooks.mkdir(exist_ok=True)
    hook = hooks / "reference-transaction"
    hook.write_text(f"#!/bin/sh\ntouch {site.state}/ran\n")
    hook.chmod(0o755)
    site.served()
    assert site.files() == {"press.yaml": "$Format:%H$\n"}
    assert not (site.state / "ran").exists()


def test_a_history_that_was_rewritten_is_refused(site: Site) -> None:
    site.git("commit", "--quiet", "--amend", "-m", "another first")
    said = site.refused()
    assert "was rewritten" in said
    assert is_untouched(site)
    (site.state / "served").unlink()  # as the message says
    site.served()


def test_a_remote_that_is_away_and_comes_back(site: Site) -> None:
    away = site.work.with_name("away")
    site.commit({"press.yaml": "two"})
    site.work.rename(away)
    assert "nothing fetched" in site.refused(code=75)
    assert is_untouched(site)
    assert site.figures()["gatewayd_mappings_ok"] == 0
    away.rename(site.work)
    site.served()
    assert site.files() == {"press.yaml": "two"}


def test_a_remote_that_accepts_and_never_answers(site: Site) -> None:
    with socket.create_server((HOST, free_port())) as silent:
        address = silent.getsockname()
        site.set(f"git://{address[0]}:{address[1]}/mappings.git", PATIENCE="1")
        assert "nothing fetched" in site.refused(code=75)
    assert is_untouched(site)


@pytest.mark.parametrize("part", ["objects", "refs", "."])
def test_a_damaged_repository_is_fetched_again(site: Site, part: str) -> None:
    """As after a power cut on a disk that lies about what it has written."""
    site.commit({"press.yaml": "two"})
    for path in (site.state / "repository.git" / part).rglob("*"):
        if path.is_file():
            path.chmod(0o600)
            path.write_bytes(b"")
    site.run()
    site.served()
    assert site.files() == {"press.yaml": "two"}


def test_locks_that_a_killed_git_has_left(site: Site) -> None:
    repository = site.state / "repository.git"
    for name in ("refs/gatewayd/fetched.lock", "packed-refs.lock", "HEAD.lock", "objects/pack/tmp_pack_x"):
        (repository / name).parent.mkdir(parents=True, exist_ok=True)
        (repository / name).touch()
    site.commit({"press.yaml": "two"})
    site.served()
    assert not list((repository / "objects/pack").glob("tmp_*"))


def test_two_runs_at_once(site: Site) -> None:
    lock = site.state / "lock"
    with subprocess.Popen(
        ["flock", lock, "sh", "-c", "echo locked; read -r end"], stdin=-1, stdout=-1
    ) as holder:
        assert holder.stdout
        assert holder.stdin
        assert holder.stdout.readline() == b"locked\n"
        done = site.run(MAPPINGS_LOCK_WAIT="0")
        assert (done.returncode, done.stderr) == (75, "gatewayd-mappings: another run is at work\n")
        with suppress(BrokenPipeError):
            holder.stdin.close()
    site.served()


@pytest.mark.parametrize(
    "arguments, reason",
    [
        (["forward"], "unknown"),
        (["--accept"], "no kind"),
        (["--accept", "release --force"], "no kind"),
        (["apply", "--force"], "unknown"),
    ],
)
def test_wrong_usage(site: Site, arguments: list[str], reason: str) -> None:
    assert reason in site.refused(*arguments, code=2)


def test_wrong_settings(site: Site) -> None:
    site.set(DIRECTORY="cells/nowhere")
    assert "has no directory cells/nowhere" in site.refused()
    site.set(DIRECTORY="cells/press/press.yaml")
    assert "is no directory" in site.refused()
    site.set(BRANCH="--upload-pack=touch")
    site.refused(code=75)
    site.settings.write_text("")
    assert "has no MAPPINGS_REMOTE" in site.refused(code=2)
    site.settings.unlink()
    assert "cannot be read" in site.refused(code=2)
    assert is_untouched(site)


@pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="ssh-keygen is missing")
def test_only_signed_commits_are_served_if_signers_are_named(site: Site, tmp_path: Path) -> None:
    for name in ("plant", "stranger"):
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", tmp_path / name], check=True)
    key = (tmp_path / "plant.pub").read_text()
    (tmp_path / "signers").write_text(f'plant@example.org namespaces="git" {key}')
    site.set(SIGNERS=tmp_path / "signers")
    site.commit({"press.yaml": "unsigned"})
    assert "is not signed by anybody in" in site.refused()
    site.git("config", "gpg.format", "ssh")
    site.git("config", "user.signingkey", tmp_path / "stranger")
    site.commit({"press.yaml": "strange"}, "change", "-S")
    assert "is not signed by anybody in" in site.refused()
    assert is_untouched(site)
    site.git("config", "user.signingkey", tmp_path / "plant")
    site.commit({"press.yaml": "signed"}, "change", "-S")
    site.served()
    assert site.files() == {"press.yaml": "signed"}
