"""The hidden-effect game: what it writes, that the seal holds, that the tool solves it, how an answer is told."""

import json

import pytest
from barberpole.challenge import game
from barberpole.cli import run
from barberpole.diagnose import diagnose
from barberpole.errors import InputError
from barberpole.log import read_log
from barberpole.modelfile import read_model


def hidden_in(folder):
    return game.answer(folder, ("none",)).hidden


def named_in(folder):
    noise = folder / game.REST
    rest = read_log(noise) if noise.exists() else None
    said = diagnose(read_log(folder / game.LOG), read_model(folder / game.MODEL), rest)
    return said.verdict, [{s.effect, *s.confounded_with} for s in said.suspects]


@pytest.mark.parametrize("level", [1, 2])
def test_the_diagnosis_solves_what_it_should(tmp_path, level):
    solved = 0
    for seed in range(6):
        folder = tmp_path / str(seed)
        game.new(folder, level, 300 + seed)
        verdict, named = named_in(folder)
        solved += verdict == "missing" and len(named) == 1 and hidden_in(folder)[0] in named[0]
    assert solved == 6


def test_the_same_seed_is_the_same_challenge(tmp_path):
    for name in "ab":
        game.new(tmp_path / name, 4, 11)
    files = [sorted((path.name, path.read_bytes()) for path in (tmp_path / name).iterdir()) for name in "ab"]
    assert files[0] == files[1]
    assert [name for name, _ in files[0]] == [game.SEALED, game.LOG, game.MODEL, game.REST]


def test_nothing_but_the_seal_tells_the_answer(tmp_path):
    for seed in range(4):
        folder = tmp_path / str(seed)
        game.new(folder, 1, seed)
        (name,) = hidden_in(folder)
        assert all(name.encode() not in path.read_bytes() for path in folder.iterdir())


def test_level_five_hides_none_one_two_or_something_foreign(tmp_path):
    counts = set()
    for seed in range(24):
        game.new(tmp_path / str(seed), 5, seed)
        hidden = hidden_in(tmp_path / str(seed))
        counts.add("foreign" if set(hidden) & set(game.FOREIGN) else len(hidden))
    assert counts == {0, 1, 2, "foreign"}


@pytest.mark.parametrize(
    ("hidden", "given", "right"),
    [
        (("cubic",), ("cubic",), True),
        (("cubic",), ("cubic", "drift"), False),
        (("cubic", "drift"), ("drift", "cubic"), True),
        ((), ("none",), True),
        ((), ("cubic",), False),
        (("ripple",), ("unknown",), True),
        (("ripple",), ("none",), False),
    ],
)
def test_an_answer_names_exactly_what_was_hidden(hidden, given, right):
    assert game.Opened(hidden, given).right is right


def test_from_the_command_line(tmp_path, capsys):
    folder = tmp_path / "game"
    assert run(["challenge", "new", "-o", str(folder), "--seed", "5"]) == 0
    assert f"barberpole diagnose {folder / game.LOG}" in capsys.readouterr().out
    (name,) = hidden_in(folder)
    assert run(["challenge", "answer", str(folder), name, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["right"] is True
    assert said["hidden"] == [name]
    before, after = said["heldout_lsb"]
    assert after < 0.3 * before
    assert run(["challenge", "answer", str(folder), "none"]) == 1
    assert f"Hidden was {name}" in capsys.readouterr().out


def test_refusals(tmp_path, capsys):
    game.new(tmp_path / "used", 1, 1)
    with pytest.raises(InputError, match="one without a challenge"):
        game.new(tmp_path / "used", 1, 1)
    with pytest.raises(InputError, match="the level must be one of 1, 2, 3, 4, 5; got 9"):
        game.new(tmp_path / "x", 9)
    with pytest.raises(InputError, match="got 'gremlins'"):
        game.answer(tmp_path / "used", ("gremlins",))
    (tmp_path / "used" / game.SEALED).write_text("open sesame")
    with pytest.raises(InputError, match="as `challenge new` wrote it"):
        game.answer(tmp_path / "used", ("none",))
    assert run(["challenge", "answer", str(tmp_path / "nowhere"), "cubic"]) == 2
    assert "answer.sealed" in capsys.readouterr().err
