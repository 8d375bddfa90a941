"""The command line: exit codes, messages, what goes where, and the chain from expert to imitator."""

import json
import os
import resource

import h5py
import pytest
from program import SMALL

COMMANDS = [
    "envs", "train", "record", "mask", "convert", "inspect", "eval", "bench", "reproduce",
]  # fmt: skip


def test_help_everywhere(agail):
    text = agail("--help")
    for command in COMMANDS:
        assert f"\n  {command} " in text
        own = agail(command, "--help")
        assert "Usage:" in own and "--help" in own
    assert "trpo.gamma" in agail("train", "--help-settings")


def test_version(agail):
    name, version = agail("--version").split()
    assert name == "agail" and version.count(".") == 2


def test_envs(agail):
    listed = {entry["environment"]: entry for entry in agail.json("envs")}
    assert {"CartPole-v0", "CartPole-v1", "Hopper-v5", "Humanoid-v4"} <= set(listed)
    assert listed["Hopper-v5"]["observation_size"] == 11 and listed["Hopper-v5"]["action_size"] == 3
    assert all(name in agail("envs") for name in listed)


# --- Wrong input --------------------------------------------------------------------------------

TRAIN = ["train", "CartPole-v1", "--method", "trpo", "--out", "run"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "subcommand"),
        (["trian"], "'train'"),
        (["train", "CartPol-v1", "--method", "trpo", "--out", "run"], "'CartPole-v1'"),
        (["train", "CartPole-v1", "--method", "tropo", "--out", "run"], "'trpo'"),
        (["train", "CartPole-v1", "--method", "trpo"], "--out"),
        (["train", "CartPole-v1", "--method", "agail", "--out", "run"], "--demos"),
        ([*TRAIN, "--set", "trpo.gama=1"], "trpo.gamma"),
        ([*TRAIN, "--set", "trpo.gamma=2"], "at most 1"),
        ([*TRAIN, "--set", "trpo.gamma=x"], "trpo.gamma"),
        ([*TRAIN, "--set", "trpo.gamma"], "key=value"),
        ([*TRAIN, "--preset", "papr"], "paper"),
        ([*TRAIN, "--preset", "absent.toml"], "absent.toml"),
        ([*TRAIN, "--timesteps", "some"], "--timesteps"),
        ([*TRAIN, "--seed", "-1"], "--seed"),
        ([*TRAIN, "--threads", "0"], "--threads"),
        ([*TRAIN, "--demo", "x"], "--demo"),
        (["eval", "absent"], "absent"),
        (["eval", "absent", "--episodes", "0"], "--episodes"),
        (["record", "absent", "--episodes", "1", "--out", "x.hdf5"], "absent"),
        (["inspect", "absent"], "absent"),
        (["mask", "absent.hdf5", "--missing", "0.5", "--out", "x.hdf5"], "absent.hdf5"),
        (["bench", "Hoper-v5"], "Hopper-v5"),
        (["bench", "CartPole-v1", "--method", "agial"], "'agail'"),
        (["bench", "CartPole-v1", "--method", "bc"], "--method bc"),
        (["bench", "CartPole-v1", "--only-stepping", "--set", "run.lanes=2000"], "run.lanes"),
        ([*TRAIN, "--seed", "010"], "--seed: '010'"),
        ([*TRAIN, "--seed", "0x10"], "--seed"),
        ([*TRAIN, "--seed", "99999999999999999999"], "--seed"),
        ([*TRAIN, "--timesteps", "9223372036854775808"], "--timesteps"),
        (["eval", "absent", "--episodes", "010"], "--episodes"),
        ([*TRAIN, "--lanes", "3", "--set", "run.batch_steps=256"], "run.lanes"),
        ([*TRAIN[:-1], ""], "--out"),
        ([*TRAIN[:-1], "x" * 300], "File name too long"),
        ([*TRAIN[:-1], "x" * 300, "--resume"], "File name too long"),
        (["eval", "x" * 300], "File name too long"),
        (["record", "x" * 300, "--episodes", "1", "--out", "x.hdf5"], "File name too long"),
        (["record", "absent", "--episodes", "1", "--out", ""], "--out"),
        (["inspect", "x" * 300], "File name too long"),
        (["mask", "x" * 50_000, "--missing", "0.5", "--out", "x.hdf5"], "File name too long"),
        (["mask", "absent.hdf5", "--missing", "0.5", "--out", "x" * 300], "File name too long"),
        (["mask", "absent.hdf5", "--missing", "", "--out", "x.hdf5"], "--missing"),
        (["bench", "CartPole-v1", "--missing", ""], "--missing"),
        (["inspect", "a\nb\x1b[31m.hdf5"], "a b [31m.hdf5"),
        ([*TRAIN, "--set", "a\nb=3"], "a b"),
        ([*TRAIN, "--set", "policy.hidden=[4294967297]"], "at most 1048576"),
        ([*TRAIN, "--set", "trpo.fisher_stride=4294967296"], "at most 1048576"),
        ([*TRAIN, "--set", "value.hidden=[1048576, 1048576]"], "not enough memory"),
    ],
    ids=lambda value: " ".join(value)[:60] if isinstance(value, list) else "",
)
def test_wrong_input(agail, tmp_path, monkeypatch, arguments, told):
    monkeypatch.chdir(tmp_path)
    assert told in agail.refused(*arguments)
    assert not (tmp_path / "run").exists(), "wrong input leaves nothing behind"


def test_wrong_mask(agail, small, tmp_path):
    for ratio in ("2", "-0.1", "nan"):
        agail.refused(
            "mask", small / "hopper.hdf5", "--missing", ratio, "--out", tmp_path / "x.hdf5"
        )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"garbage", b"\x89HDF\r\n\x1a\n" + bytes(100)])
def test_bad_demonstrations(agail, tmp_path, content):
    path = tmp_path / "bad.hdf5"
    path.write_bytes(content)
    assert "bad.hdf5" in agail.refused("inspect", path)
    assert "bad.hdf5" in agail.refused(
        "train", "CartPole-v1", "--method", "agail", "--demos", path, "--out", tmp_path / "run"
    )


def test_demonstrations_of_another_environment(agail, small, tmp_path):
    error = agail.refused(
        "train", "Hopper-v5", "--method", "agail", "--demos", small / "cartpole.hdf5",
        "--out", tmp_path / "run",
    )  # fmt: skip
    assert "observation" in error


def test_out_that_is_taken(agail, small, tmp_path):
    run = small / "cartpole-expert"
    before = (run / "policy.safetensors").read_bytes()
    assert "--resume" in agail.refused("train", "CartPole-v1", "--method", "trpo", "--out", run)
    assert (run / "policy.safetensors").read_bytes() == before
    (tmp_path / "thesis.tex").write_text("mine")
    agail.refused("train", "CartPole-v1", "--method", "trpo", "--out", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_file_size_limit_is_a_full_disk(agail, small, tmp_path):
    done = agail.run(
        "mask", small / "cartpole.hdf5", "--missing", 0.5, "--out", tmp_path / "x.hdf5",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)),
    )  # fmt: skip
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_out_that_cannot_be_created(agail, small, tmp_path):
    (tmp_path / "file").write_text("")
    for out in (tmp_path / "file" / "run", "/proc/run"):
        agail.refused("train", "CartPole-v1", "--method", "trpo", "--out", out)
    for out in (tmp_path / "file" / "x.hdf5", tmp_path / "file" / "folder"):
        agail.refused("mask", small / "cartpole.hdf5", "--missing", 0.5, "--out", out)
        agail.refused("record", small / "cartpole-expert", "--episodes", 1, "--out", out)


def test_out_is_checked_first(agail, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("x")
    for command in (
        ["record", "absent", "--episodes", 1],
        ["mask", "absent.hdf5", "--missing", 0.5],
        ["convert", "absent.npz", "--env", "Hopper-v5"],
    ):
        assert "no Minari dataset" in agail.refused(*command, "--out", mine)
        assert "is a file" in agail.refused(*command, "--out", f"{mine}/thesis.tex/")
        assert "absent" in agail.refused(*command, "--out", tmp_path / "new" / "x.hdf5")
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert (mine / "thesis.tex").read_text() == "x"


def test_damaged_summary(agail, tmp_path):
    (tmp_path / "config.toml").touch()
    assert "no summary.json" in agail.json("inspect", tmp_path)["note"]
    summary = tmp_path / "summary.json"
    for content in ("", "[]", "5", '"x"', "null", '{"seed": 1', "[" * 200_000, '{"a":' * 200_000):
        summary.write_text(content)
        assert "summary.json is damaged" in agail.refused("inspect", tmp_path)
    summary.unlink()
    summary.mkdir()
    assert "it is a folder" in agail.refused("inspect", tmp_path)


def damaged(whole):
    """The same bytes cut short or with one bit flipped, at places all over the file."""
    for share in (0, 0.01, 0.3, 0.9):
        yield whole[: int(share * len(whole))]
    yield whole[:-1]
    for share in (0, 0.005, 0.01, 0.5, 0.999):
        at = int(share * len(whole))
        yield whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]
    yield b"garbage"


def test_damaged_policy(agail, small, tmp_path):
    whole = (small / "cartpole-expert" / "policy.safetensors").read_bytes()
    for number, content in enumerate(damaged(whole)):
        path = tmp_path / f"{number}.safetensors"
        path.write_bytes(content)
        assert path.name in agail.refused("eval", path, "--episodes", 1)
        assert path.name in agail.refused("inspect", path)


def test_damaged_checkpoint(agail, tmp_path):
    run = tmp_path / "run"
    train = ["train", "CartPole-v1", "--method", "trpo", "--out", run, *SMALL]
    agail(*train, "--timesteps", 512)
    checkpoint = run / "checkpoints" / "latest.safetensors"
    for content in damaged(checkpoint.read_bytes()):
        checkpoint.write_bytes(content)
        assert "latest.safetensors" in agail.refused(*train, "--timesteps", 1024, "--resume")


def test_a_policy_is_not_a_checkpoint(agail, small):
    checkpoint = small / "cartpole-expert" / "checkpoints" / "latest.safetensors"
    assert "policy" in agail.refused("eval", checkpoint)


# --- Results ------------------------------------------------------------------------------------


def test_from_expert_to_imitator(agail, small, tmp_path):
    environment = "CartPole-v1"
    whole, part = small / "cartpole.hdf5", small / "cartpole-part.hdf5"
    facts = agail.json("inspect", part)
    assert facts["environment"] == environment and facts["episodes"] == 6
    assert facts["transitions"] == agail.json("inspect", whole)["transitions"]
    # Exact in each episode up to half a step.
    assert facts["missing_ratio"] == pytest.approx(0.5, abs=3 / facts["transitions"] + 1e-12)
    assert facts["mean_return"] == pytest.approx(facts["transitions"] / 6)

    for method in ("bc", "gail", "state-gail", "agail"):
        run = tmp_path / method
        out = agail(
            "train", environment, "--method", method, "--demos", part, "--out", run,
            "--timesteps", 2000, *SMALL,
        )  # fmt: skip
        assert len(out.splitlines()) == 1 and out.startswith(str(run))
        result = agail.json("eval", run, "--episodes", 4)
        assert result["environment"] == environment and result["episodes"] == 4
        assert 1 <= result["mean_return"] <= 500 and result["standard_error"] >= 0
        share = result["mean_return"] / facts["mean_return"]
        assert result["share_of_demonstrations"] == pytest.approx(share)
        assert agail.json("eval", run / "policy.safetensors", "--episodes", 4) == result


def test_an_expert_has_no_demonstrations_to_share(agail, small):
    result = agail.json("eval", small / "cartpole-expert", "--episodes", 2)
    assert result["share_of_demonstrations"] is None


def test_no_share_of_a_negative_return(agail, small, tmp_path):
    demos = tmp_path / "costs.hdf5"
    demos.write_bytes((small / "cartpole.hdf5").read_bytes())
    with h5py.File(demos, "r+") as file:
        for name in file:
            file[name]["rewards"][...] *= -1
    agail(
        "train",
        "CartPole-v1",
        "--method",
        "bc",
        "--demos",
        demos,
        "--out",
        tmp_path / "run",
        *SMALL,
    )
    assert agail.json("eval", tmp_path / "run")["share_of_demonstrations"] is None
    assert "share" not in agail("eval", tmp_path / "run")


def test_inspect_tells_policies_and_runs_apart(agail, small):
    run = small / "hopper-expert"
    summary = json.loads((run / "summary.json").read_text())
    described = agail.json("inspect", run)
    assert described["method"] == "trpo" and summary.items() <= described.items()
    policy = agail.json("inspect", run / "policy.safetensors")
    assert policy["environment"] == "Hopper-v5" and policy["hidden"] == [8, 8]
    for path in (run, run / "policy.safetensors", small / "hopper.hdf5"):
        assert "Hopper-v5" in agail("inspect", path)


def test_bench(agail):
    (result,) = agail.json("bench", "CartPole-v1", "--updates", 2, "--missing", 0.5)
    assert {"environment", "stepping_us", "training_us", "ratio", "signature"} <= set(result)
    assert result["ratio"] == pytest.approx(result["training_us"] / result["stepping_us"])
    again = agail.json("bench", "CartPole-v1", "--updates", 2, "--missing", 0.5)
    assert again[0]["signature"] == result["signature"]


def test_what_convert_ignores_is_a_note(agail, tmp_path):
    arrays, out = tmp_path / "arrays.csv", tmp_path / "demos.hdf5"
    names = ["no\x1bte", *(f"extra_{i}" for i in range(11))]
    table = [["obs_0", *names], [0, *names], [1, *names]]

    def convert():
        arrays.write_text("".join(",".join(map(str, row)) + "\n" for row in table))
        return agail.run("convert", arrays, "--env", "Some-v0", "--out", out)

    shown = ", ".join(["no te", *names[1:10]])
    assert convert().stderr == f"agail: note: ignored in {arrays}: {shown} and 2 more\n"
    assert out.exists()
    table[2][0] = "nan"
    done = convert()
    assert done.returncode == 2 and "ignored" not in done.stderr, "first whether it works"


def test_results_on_stdout_progress_on_stderr(agail, tmp_path):
    done = agail.run(*TRAIN[:-1], tmp_path / "run", "--timesteps", 1000, *SMALL)
    assert done.returncode == 0
    assert "mean return" in done.stdout and "steps/s" not in done.stdout
    assert "1024/1000 steps" in done.stderr
    assert "\r" not in done.stderr and "\x1b" not in done.stderr, "no terminal, no bar"


def test_recorded_and_masked_files_are_the_same_each_time(agail, small, tmp_path):
    for number in range(2):
        out = tmp_path / f"{number}.hdf5"
        agail("record", small / "cartpole-expert", "--episodes", 6, "--out", out)
        assert out.read_bytes() == (small / "cartpole.hdf5").read_bytes()
        agail("mask", out, "--missing", 0.5, "--out", tmp_path / f"{number}-part.hdf5")
    part = (small / "cartpole-part.hdf5").read_bytes()
    assert all((tmp_path / f"{number}-part.hdf5").read_bytes() == part for number in range(2))


# --- Extensions ---------------------------------------------------------------------------------


def test_extensions(agail, tmp_path, monkeypatch):
    program = tmp_path / "agail-hello"
    program.write_text('#!/bin/sh\necho "$# $1 $2"\nexit 7\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    done = agail.run("hello", "--episodes", "two words")
    assert done.returncode == 7 and done.stdout == "2 --episodes two words\n"


def test_methods_are_told(agail):
    names = "trpo gail state-gail agail bc bco"
    told = agail.refused("train", "CartPole-v1", "--method", "bcoo", "--out", "run")
    assert "'bco'" in told and f"({names})" in told
    assert names in " ".join(agail("train", "--help").split())


def test_no_such_extension(agail, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "agail-hello" in agail.refused("hello")
    assert "'eval'" in agail.refused("evla")
    for command in ("export", "report", "video"):
        assert "Python package" in agail.refused(command)
