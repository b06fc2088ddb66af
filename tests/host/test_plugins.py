"""A user's own effects: the template works as it is, and what is broken says so in one sentence."""

from pathlib import Path

import numpy as np
import pytest
from barberpole.effects import Conditions, Setup
from barberpole.errors import InputError
from barberpole.model import compose
from barberpole.plugins import TEMPLATE, load_plugin, load_plugins, new_plugin

HEAD = "import numpy as np\nfrom barberpole.effects.effect import per_axis\n"
PARAMS = "def params(setup):\n    return per_axis('1/uT', typical=1e-4)\n"
FORWARD = "def forward(xyz, p, at):\n    x, y, z = xyz\n    return {}\n"
BENT = "x + p[0] * x * x, y + p[1] * y * y, z + p[2] * z * z"


def plugin(folder: Path, out: str = BENT, more: str = "", name: str = "mine") -> Path:
    """A plugin file whose forward returns `out`."""
    path = folder / f"{name}.py"
    path.write_text(HEAD + more + PARAMS + FORWARD.format(out))
    return path


def text(folder: Path, content: str) -> Path:
    path = folder / "mine.py"
    path.write_text(content)
    return path


def test_template_is_short_and_works_as_it_is(tmp_path: Path):
    path = new_plugin("eddy_lag", tmp_path)
    assert len(path.read_text().splitlines()) <= 40
    assert path.read_text().startswith('"""eddy_lag: ')
    effect = load_plugin(path)
    assert effect.name == "eddy_lag"
    assert effect.equation in TEMPLATE.read_text()
    assert list(tmp_path.iterdir()) == [path]  # no cache left beside it


def test_forward_alone_is_fitted_and_inverted(tmp_path: Path):
    extra = load_plugins([plugin(tmp_path)])
    setup = Setup(lsb_per_ut=3.0)
    model = compose(("mine", "cross_field", "scale"), setup, extra)
    assert model.effects == ("mine", "cross_field", "scale")
    p = model.first + np.array([q.typical for q in model.params])
    field, at = np.random.default_rng(0).uniform(-50, 50, (3, 200)), Conditions(state=np.zeros(200))
    assert np.max(np.abs(model.invert(model.predict(field, p, at), p, at) - field)) < 1e-11


def test_derivatives_are_those_of_the_catalogue(tmp_path: Path):
    effect, field = load_plugin(plugin(tmp_path)), np.random.default_rng(0).uniform(-50, 50, (3, 50))
    d_in, d_p = effect.derivatives(field, np.array([1e-4, -2e-4, 3e-4]), Conditions())
    for axis, q in enumerate((1e-4, -2e-4, 3e-4)):
        assert np.allclose(d_in[axis, axis], 1 + 2 * q * field[axis], rtol=1e-13)
        assert np.allclose(d_p[axis, axis], field[axis] ** 2, rtol=1e-13)
    assert not effect.compilable
    assert any("by iteration" in note for note in effect.notes)


def test_differences_serve_where_the_complex_step_fails(tmp_path: Path):
    effect = load_plugin(plugin(tmp_path, "x + p[0] * x * np.abs(x), y, z"))
    field = np.random.default_rng(0).uniform(-50, 50, (3, 50))
    d_in, d_p = effect.derivatives(field, np.array([1e-3, 0, 0]), Conditions())
    assert np.allclose(d_p[0, 0], field[0] * np.abs(field[0]), rtol=1e-8, atol=1e-6)
    assert np.allclose(d_in[0, 0], 1 + 2e-3 * np.abs(field[0]), rtol=1e-6)
    assert any("differences" in note for note in effect.notes)


def test_memory_is_carried_and_undone(tmp_path: Path):
    loop = """
def low(v, tau):
    out = [v[0]]
    for one in v[1:]:
        out.append(out[-1] + (one - out[-1]) / (1 + tau))
    return np.array(out)
"""
    out = "tuple(low(v, 1e3 * q) for v, q in zip(xyz, p))"
    effect = load_plugin(plugin(tmp_path, out, "MEMORY = True\n" + loop))
    model = compose(("mine", "scale"), Setup(), (effect,))
    p = np.array([1e-4, 2e-4, 3e-4, 1.0, 1.0, 1.0])
    field, at = 40 * np.sin(0.3 * np.arange(90) + np.arange(3)[:, None]), Conditions(t_s=np.arange(90.0))
    y, columns, _ = model.linearise(field, p, at)
    for j in range(6):
        step = model.predict(field, p + 1e-30j * (np.arange(6) == j), at).imag / 1e-30
        assert np.max(np.abs(columns[:, j] - step)) <= 1e-11 * np.max(np.abs(step))
    assert np.max(np.abs(model.invert(y, p, at) - field)) < 1e-9


def test_own_arithmetic_undo_can_go_to_the_board(tmp_path: Path):
    undo = "def undo(xyz, p, at):\n    return tuple((v - q) for v, q in zip(xyz, p))\n"
    assert load_plugin(plugin(tmp_path, "x + p[0], y + p[1], z + p[2]", undo)).compilable
    sine = "def undo(xyz, p, at):\n    return tuple((v - q * np.cos(0)) for v, q in zip(xyz, p))\n"
    assert load_plugin(plugin(tmp_path, "x + p[0], y + p[1], z + p[2]", sine)).compilable
    branch = "def undo(xyz, p, at):\n    return tuple((v - q * (np.max(v) < 1e9)) for v, q in zip(xyz, p))\n"
    effect = load_plugin(plugin(tmp_path, "x + p[0], y + p[1], z + p[2]", branch))
    assert effect.off_board == "its undo needs more than + - * / and sqrt"


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("def forward(xyz:\n", r"a plugin must be valid Python; got .* \(.*mine.py, line 1\)"),
        ("\n\nimport nowhere\n", r"must be a file that runs; got ModuleNotFoundError.* \(.*mine.py, line 3\)"),
        (HEAD + PARAMS, r"a plugin must be a file that defines forward\(xyz, p, at\); got no forward \(.*mine.py\)"),
        (HEAD + FORWARD.format("xyz"), r"a plugin must be a file that defines params\(setup\); got no params"),
        ("STAGE = 'sky'\n" + HEAD + PARAMS + FORWARD.format("xyz"), "STAGE must be 'field' or 'reading'; got 'sky'"),
        ("REQUIRES = ('temp',)\n" + HEAD + PARAMS + FORWARD.format("xyz"), "REQUIRES must be some of t_s, temp_c"),
        (
            HEAD + "def params(setup):\n    return per_axis('1')\n" + FORWARD.format("xyz"),
            r"parameter x must be one with a typical size .* \(.*mine.py, line 3\)",
        ),
        (
            HEAD + "def params(setup):\n    1 / 0\n" + FORWARD.format("xyz"),
            "params must be a function that runs",
        ),
        (HEAD + "def params(setup):\n    return ['a']\n" + FORWARD.format("xyz"), "params must be a tuple of Param"),
    ],
)
def test_a_broken_file_gives_one_sentence(tmp_path: Path, content: str, sentence: str):
    with pytest.raises(InputError, match=sentence) as caught:
        load_plugin(text(tmp_path, content))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("out", "sentence"),
    [
        ("x, y", r"three components in and out; got shape \(2, 48\) from \(3, 48\) \(.*mine.py, line 5\)"),
        ("x, y, z[:5]", "forward must be a function .* got ValueError"),
        ("1.01 * x, y, z", "forward must be the identity while all parameters are at null; got a change of"),
        ("x + np.log(-p[0] * x * x) if p[0] else x, y, z", "forward must be finite at typical parameters; got NaN"),
        ("x + p[0] * at.temp_c, y, z", r"runs with the columns in REQUIRES; got TypeError.* \(.*mine.py, line 7\)"),
        ("x + p[0] * at.state, y, z", "the same after SET and RESET unless FLIPS = True"),
        ("x + p[0] * np.cumsum(x), y, z", "without memory unless MEMORY = True"),
        ("np.copyto(x, x + p[0]) or x, y, z", "leaves xyz as it was; got xyz changed in place"),
    ],
)
def test_a_wrong_forward_gives_one_sentence(tmp_path: Path, out: str, sentence: str):
    with pytest.raises(InputError, match=sentence):
        load_plugin(plugin(tmp_path, out))


def test_a_wrong_undo_gives_one_sentence(tmp_path: Path):
    undo = "def undo(xyz, p, at):\n    return tuple(v + q for v, q in zip(xyz, p))\n"
    with pytest.raises(InputError, match=r"undo must be the inverse of forward; got a field .* off \(.*, line 3\)"):
        load_plugin(plugin(tmp_path, "x + p[0], y + p[1], z + p[2]", undo))


def test_names_are_checked(tmp_path: Path):
    for name in ("lag", "hard_iron"):
        with pytest.raises(InputError, match="must be none of the catalogue's"):
            load_plugin(plugin(tmp_path, name=name))
    with pytest.raises(InputError, match="must be small letters"):
        new_plugin("Eddy-Lag", tmp_path)
    new_plugin("twice", tmp_path)
    with pytest.raises(InputError, match="a new effect must be a file that is not there yet"):
        new_plugin("twice", tmp_path)
    (tmp_path / "other").mkdir()
    with pytest.raises(InputError, match="of different names; got mine twice"):
        load_plugins([plugin(tmp_path), plugin(tmp_path / "other")])
    with pytest.raises(InputError, match="a plugin must be a file that can be read"):
        load_plugin(tmp_path / "absent.py")
