"""Model files: bare lists, comments that survive an edit, refusals."""

import pytest
from barberpole.errors import InputError
from barberpole.modelfile import ModelFile, add_effect, read_model, remove_effect, write_model

TEXT = """# my sensor
effects = [
    "bias",   # the magnets beside it
    "scale",
]
plugins = ["iron.py"]
[reference]
kind = "constant"  # turned by hand
magnitude_ut = 48.9
[scale]
shared = true
"""


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text(TEXT)
    return file


def test_reads_all_parts(path):
    model = read_model(path)
    assert model.effects == ("bias", "scale")
    assert model.settings == {"scale": {"shared": True}}
    assert model.reference == {"kind": "constant", "magnitude_ut": 48.9}
    assert model.plugins == (str(path.parent / "iron.py"),)


def test_bare_list():
    assert read_model(" bias, scale,misalignment ") == ModelFile(("bias", "scale", "misalignment"))


def test_adding_keeps_comments(path):
    write_model(add_effect(read_model(path), "cross_field"), path)
    text = path.read_text()
    assert read_model(path).effects == ("bias", "scale", "cross_field")
    for comment in ("# my sensor", "# the magnets beside it", "# turned by hand"):
        assert comment in text
    write_model(remove_effect(read_model(path), "cross_field"), path)
    assert read_model(path).effects == ("bias", "scale")


def test_new_file_carries_everything(path, tmp_path):
    model = read_model(path)
    (tmp_path / "sub").mkdir()
    copy = tmp_path / "sub" / "copy.toml"
    write_model(ModelFile(model.effects, model.settings, model.reference, model.plugins, "hmc1021_1022"), copy)
    again = read_model(copy)
    assert (again.effects, again.settings, again.reference) == (model.effects, model.settings, model.reference)
    assert again.sensor == "hmc1021_1022"


def test_hash_tells_models_apart(path):
    model = read_model(path)
    assert len(model.hash) == 12
    assert model.hash == read_model(path).hash
    assert model.hash != add_effect(model, "lag").hash


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("effects = [", "efects = [", "closest: effects"),
        ('"scale",', '"scale", "bias",', "effect bias must be named once"),
        ("[scale]", "[scales]", "closest: scale"),
        ("magnitude_ut", "magnitude_nt", "closest: reference.magnitude_ut"),
        ('"constant"', '"fixed"', "reference.kind"),
        ("48.9", '"48.9"', "valid number"),
        ('"bias",', "7,", "effects[0]"),
        ("[scale]", "[scale", "valid TOML"),
    ],
)
def test_refusals(path, old, new, says):
    assert old in TEXT
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_model(path)
    assert says in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("spec", ["", "bias;scale", "Bias,scale", "nowhere.toml", "bias,bias"])
def test_bad_spec(spec):
    with pytest.raises(InputError):
        read_model(spec)


def test_adding_twice_and_removing_nothing(path):
    with pytest.raises(InputError, match="lacks"):
        add_effect(read_model(path), "bias")
    with pytest.raises(InputError, match="one of bias, scale"):
        remove_effect(read_model(path), "lag")
