"""design: what is dimensioned before a board is built: coil, shield, noise, flip rate."""

from typing import Annotated

import numpy as np
import typer

from barberpole.board import load_board
from barberpole.commands.console import AS_JSON, OUT, print_json, table
from barberpole.design import flipping, shield
from barberpole.design.noise_budget import board_front_end, noise_budget
from barberpole.design.parts import find_amplifier
from barberpole.errors import InputError, must
from barberpole.units import NT_PER_UT

UNITS = {"ut": "µT", "nt": "nT", "ma": "mA", "mm": "mm", "mw": "mW", "hz": "Hz", "deg": "°", "db": "dB"}
WHOLE_UNITS = {"ut_per_ma": "µT/mA", "nt_per_rthz": "nT/√Hz"}
SHAPES = {"cylinder": shield.CYLINDER, "sphere": shield.SPHERE}
EARTH_UT = 50.0
ROUNDING = 1e-12  # below it a value is nothing

Board = Annotated[str, typer.Argument(help="Board name or .toml.")]


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    group = typer.Typer(
        help="Dimension a coil, a shield, the noise and the flip rate of a board.", no_args_is_help=True
    )
    for command in (coil, shield_, noise, flip):
        group.command(command.__name__.rstrip("_"))(command)
    app.add_typer(group, name="design")


def coil(
    radius_mm: Annotated[float, typer.Option(help="Radius of both loops.")] = 100.0,
    turns: Annotated[float, typer.Option(help="Turns of each loop.")] = 60.0,
    field_ut: Annotated[float, typer.Option(help="Field wanted at the centre, µT.")] = EARTH_UT,
    region_mm: Annotated[float, typer.Option(help="Side of the square that the sensor needs.")] = 20.0,
    tilt_deg: Annotated[float, typer.Option(help="Angular error of one loop.")] = 0.0,
    tolerance: Annotated[float, typer.Option(help="Relative deviation that is still uniform.")] = 1e-3,
    ohm: Annotated[float, typer.Option(help="Resistance of the pair, for its heat.")] = 0.0,
    as_json: bool = AS_JSON,
) -> None:
    """A Helmholtz coil: current for a field, uniform region, angle, heat."""
    from barberpole.design import coil as coils  # magpylib takes most of a second to load

    _positive(radius_mm=radius_mm, turns=turns, field_ut=field_ut, region_mm=region_mm, tolerance=tolerance)
    tilt_rad = float(np.deg2rad(tilt_deg))
    pair = coils.CoilPair(radius_mm, turns, tilt_rad=tilt_rad)
    constant = coils.constant_ut_per_ma(pair)
    answer = {
        "constant_ut_per_ma": constant,
        "current_ma": field_ut / constant,
        "deviation_nt": coils.largest_deviation(pair, region_mm / 2) * field_ut * NT_PER_UT,
        "direction_error_deg": float(np.rad2deg(coils.direction_error_rad(pair))),
        "uniform_side_mm": 2 * coils.uniform_half_side_mm(pair, tolerance),
        "radius_for_region_mm": coils.radius_for_region_mm(region_mm / 2, tolerance, tilt_rad),
    }
    if ohm:
        answer["heat_mw"] = coils.resistive_power_mw(ohm, answer["current_ma"])
    _show("Helmholtz coil", answer, as_json)


def shield_(
    inner_mm: Annotated[float, typer.Option(help="Radius of the room inside.")] = 200.0,
    thickness_mm: Annotated[float, typer.Option(help="Thickness of each shell.")] = 1.0,
    gap_mm: Annotated[float, typer.Option(help="Gap between shells.")] = 10.0,
    layers: Annotated[int, typer.Option(help="Number of shells.")] = 4,
    permeability: Annotated[float, typer.Option(help="Relative permeability of the material.")] = 11000.0,
    shape: Annotated[str, typer.Option(help=f"One of {', '.join(SHAPES)}.")] = "cylinder",
    as_json: bool = AS_JSON,
) -> None:
    """A shield: attenuation of long cylinders (field across) or spheres, and what is left of the Earth's field."""
    _positive(inner_mm=inner_mm, thickness_mm=thickness_mm, layers=layers, permeability=permeability)
    if shape not in SHAPES or gap_mm < 0:
        raise InputError(must("the shield", f"one of {', '.join(SHAPES)}, with no gap below 0", f"{shape!r}, {gap_mm}"))
    shells = shield.nested(inner_mm, thickness_mm, gap_mm, layers)
    factor = shield.exact_factor(shells, permeability, SHAPES[shape])
    answer = {
        "factor": factor,
        "attenuation_db": shield.decibel(factor),
        "left_of_earth_nt": EARTH_UT * NT_PER_UT / factor,
    }
    if shape == "cylinder":
        answer["factor_by_thesis"] = shield.cylinder_factor(shells, permeability)
    _show(f"shield of {layers} layers", answer, as_json)


def noise(
    board: Board,
    amplifier: Annotated[str | None, typer.Option(help="LM324, OPA4377, AD8648 or AMP04 before the converter.")] = None,
    gain: Annotated[float, typer.Option(help="Gain of that amplifier.")] = 1.0,
    conversion_uv: Annotated[float, typer.Option(help="Noise of one conversion, µV rms (data sheet).")] = 0.0,
    as_json: bool = AS_JSON,
) -> None:
    """The noise of sensor, amplifier, converter and flipping, in nT/√Hz."""
    target = load_board(board)
    _positive(gain=gain)
    part = find_amplifier(amplifier) if amplifier else None
    budget = noise_budget(board_front_end(target, part, gain, conversion_uv))
    answer = {
        "bridge_nt_per_rthz": budget.bridge_nt,
        "amplifier_nt_per_rthz": budget.amplifier_nt,
        "converter_nt_per_rthz": budget.converter_nt,
        "white_nt_per_rthz": budget.white_nt,
        "flip_factor": budget.flip_factor,
        "total_nt_per_rthz": budget.total_nt,
        "sensor_file_nt_per_rthz": target.sensor.noise_nt_per_rthz,
    }
    _show(f"noise of {target.name}", answer, as_json)


def flip(
    board: Board,
    bandwidth_hz: Annotated[float, typer.Option(help="Highest frequency of the field that must be seen.")] = 20.0,
    budget_mw: Annotated[float, typer.Option(help="Power that flipping may take.")] = 30.0,
    full_bridge: Annotated[bool, typer.Option(help="The capacitor swings from -V to +V.")] = False,
    standing_mw: Annotated[float, typer.Option(help="Power drawn without flipping.")] = 0.0,
    as_json: bool = AS_JSON,
) -> None:
    """The flip rate of a board: noise and power at its own rate, and the rate to choose."""
    target = load_board(board)
    own, corner_hz = target.flip, target.sensor.corner_hz
    bridge = flipping.FULL_BRIDGE if full_bridge else flipping.HALF_BRIDGE
    circuit = flipping.FlipCircuit(own.capacitor_nf, own.strap_supply_v, bridge, standing_mw=standing_mw)
    dead_us = own.pulse_us + own.settle_us
    choice = flipping.choose_rate(circuit, corner_hz, dead_us, bandwidth_hz, budget_mw)
    answer = {
        "rate_hz": own.rate_hz,
        "power_mw": flipping.flip_power_mw(circuit, own.rate_hz),
        "noise_factor": flipping.noise_factor(own.rate_hz, corner_hz, dead_us),
        "lowest_hz": choice.lowest_hz,
        "highest_hz": choice.highest_hz,
        "quietest_hz": choice.quietest_hz,
        "chosen_hz": choice.rate_hz,
        "decided_by": choice.decided_by,
        "chosen_power_mw": choice.power_mw,
        "chosen_noise_factor": choice.noise_factor,
    }
    _show(f"flipping of {target.name}", answer, as_json)


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(must(f"--{name.replace('_', '-')}", "a positive number", value))


def _show(title: str, answer: dict, as_json: bool) -> None:
    if as_json:
        print_json(answer)
        return
    shown = table(title, "quantity", "value", "unit")
    for name, value in answer.items():
        words, unit = _split(name)
        shown.add_row(
            words, value if isinstance(value, str) else f"{value if abs(value) > ROUNDING else 0.0:.5g}", unit
        )
    OUT.print(shown)


def _split(name: str) -> tuple[str, str]:
    """ "current_ma" is "current" in "mA"."""
    for ending, unit in (WHOLE_UNITS | UNITS).items():
        if name.endswith(f"_{ending}"):
            return name.removesuffix(f"_{ending}").replace("_", " "), unit
    return name.replace("_", " "), ""
