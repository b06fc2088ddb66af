"""What stands behind the page, without a browser: the path of attempts, the work, the worker, the guard."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from barberpole.errors import InputError
from barberpole.workbench import tasks
from barberpole.workbench.bench import Bench, merged, ranges_of
from barberpole.workbench.guard import Guard, below
from barberpole.workbench.history import History
from barberpole.workbench.lab import Lab
from barberpole.workbench.pictures import Box, View
from barberpole.workbench.session import Session
from barberpole.workbench.worker import Stopped, Worker

NOISE_LSB = 2.0  # of the log `crossed`


def in_thread(work):
    """Run a coroutine where no loop runs yet: playwright has one in this thread."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result(60)


def benches(log, *files):
    bench = Bench(log)
    return [bench.with_file(replace(bench.file, effects=effects)) for effects in files]


def test_rows_left_out_are_ranges():
    assert ranges_of(np.array([3, 1, 2, 7])) == [(1, 4), (7, 8)]
    assert ranges_of(np.array([], int)) == []
    assert merged([(5, 8), (0, 2), (2, 3), (6, 9)]) == ((0, 3), (5, 9))
    bench = Bench("log.csv", excluded=((0, 2),)).without(np.array([2, 5]))
    assert bench.excluded == ((0, 3), (5, 6))
    assert np.flatnonzero(bench.kept(7)).tolist() == [3, 4, 6]


def test_the_path_forks_and_nothing_is_lost(tmp_path):
    start, one, two, other = benches(tmp_path, ("bias",), ("bias", "scale"), ("bias", "drift"), ("scale",))
    history = History.begin(start).do("one", one).do("two", two)
    back = history.undo().undo()
    assert back.now.bench == start
    assert back.undo() == back
    assert back.redo().redo().now.bench == two
    forked = back.redo().do("other", other)
    assert [forked.steps[at].label for at in forked.trail()] == ["start", "one", "other"]
    assert forked.redo() == forked
    assert [forked.steps[at].label for _, at in forked.tree()] == ["start", "one", "two", "other"]
    assert forked.go(2).now.bench == two
    again = forked.undo().do("the same", other)  # where a step already leads there, none is added
    assert len(again.steps) == len(forked.steps)
    walked = history.go(0)
    assert walked.redo().now.bench == one
    assert history.measured(2.0, 3.0).now.heldout_lsb == 3.0


def test_the_hidden_effect_is_first_and_takes_the_error_to_the_noise(crossed):
    lab, bench = Lab(), Bench(crossed)
    assert tasks.open_log(lab, bench).reference == "vector"
    before = tasks.summary(lab, bench)
    found = tasks.suspects(lab, bench)
    first = found.suspects[0]
    assert (found.verdict, first.effect, first.named) == ("missing", "cross_field", True)
    assert first.explains > 0.95
    assert all(s.explains < first.explains and not s.named for s in found.suspects[1:])
    after = tasks.summary(lab, tasks.with_effect(lab, bench, first.effect, first.settings))
    assert before.heldout_lsb > 8 * NOISE_LSB
    assert after.heldout_lsb == pytest.approx(NOISE_LSB, rel=0.05)
    assert found.noise_lsb == pytest.approx(NOISE_LSB, rel=0.05)


def test_a_box_chooses_the_same_rows_in_every_picture(crossed):
    lab, bench = Lab(), Bench(crossed)
    view = View("temp_c")
    drawn = {name: lab.picture(bench, view, name) for name in ("traces", "residual", "sphere")}
    assert all(one.title and one.sentence for one in drawn.values())
    assert not tasks.picture(lab, bench, view, "traces").samples  # not sent
    temp, t_s = lab.log(crossed)["temp_c"], lab.log(crossed)["t_s"]
    found = tasks.select(lab, bench, Box("temp_c", (25.0, 26.0)), view)
    wanted = (temp >= 25.0) & (temp <= 26.0)
    assert found.samples == wanted.sum()
    assert set(found.points) == {"traces", "residual"}
    for name, by_trace in found.points.items():
        for trace, points in by_trace.items():
            samples = drawn[name].samples[trace][points]
            assert np.all(wanted[samples])
            assert len(points) == wanted[drawn[name].samples[trace]].sum()
    smaller = tasks.exclude(lab, bench, Box("temp_c", (25.0, 26.0)))
    assert tasks.summary(lab, smaller).n == 3000 - wanted.sum()
    again = tasks.exclude(lab, smaller, Box("t_s", (0.0, 1.0)))  # rows are those of the file, whatever is out already
    assert np.flatnonzero(again.kept(3000)).tolist() == np.flatnonzero(~wanted & (t_s > 1.0)).tolist()


def test_a_residual_is_chosen_by_its_axis(crossed):
    lab, bench = Lab(), Bench(crossed)
    residual = lab.traces(bench).residual

    def chosen(box) -> int:
        return tasks.select(lab, bench, box, View()).samples

    assert chosen(Box("t_s", (0, 1e9), (5.0, 1e9), 1)) == np.sum(residual[1] >= 5.0)
    assert chosen(Box("t_s", (0, 1e9), (5.0, 1e9))) == np.sum(np.any(residual >= 5.0, axis=0))


def test_a_residual_lies_on_the_diagonal_of_the_products_that_explain_it(crossed):
    """cross_field changes its sign with the flip state, so that no single field shows it."""
    lab, bench = Lab(), Bench(crossed)
    traces = lab.traces(bench)
    worst = tasks.suspects(lab, bench).patterns[0]
    channel, product = traces.axes.index(worst[0]), traces.abscissae[worst[1]]
    assert product.product
    assert product.title == "flip state × field, LSB"
    x, y = product.values[channel], traces.residual[channel]
    slope = float(x @ y / (x @ x))
    assert slope == pytest.approx(1.0, abs=0.02)
    assert np.sqrt(np.mean(x**2)) == pytest.approx(worst[3], rel=0.1)  # of all that the pattern tells
    drawn = lab.picture(bench, View(product.name), "residual")
    assert "diagonal" in drawn.sentence
    high = float(np.quantile(x, 0.9))
    found = tasks.select(lab, bench, Box(product.name, (high, 1e9), None, channel), View(product.name))
    assert found.samples == np.sum(x >= high)


def test_a_worker_answers_refuses_and_stops(crossed, tmp_path):
    async def use() -> None:
        worker, bench = Worker(), Bench(crossed)
        assert (await worker.ask("open_log", bench)).rows == 3000
        with pytest.raises(InputError, match="the log must be a file that can be read"):
            await worker.ask("open_log", Bench(tmp_path / "none.csv"))
        asked = asyncio.ensure_future(worker.ask("suspects", bench))
        await asyncio.sleep(0.05)
        worker.stop()
        with pytest.raises(Stopped):
            await asked
        assert (await worker.ask("summary", bench)).n == 3000  # the next request starts it again
        worker.close()

    in_thread(use())


def test_a_session_walks(crossed, tmp_path, monkeypatch):
    async def use() -> None:
        said = []
        session = Session(tmp_path, said.append)
        assert not await session.open(tmp_path / "none.csv")
        assert "must be a file" in session.message
        assert await session.open(crossed)
        until = time.monotonic() + 30
        while session.suspicion is None and time.monotonic() < until:
            await asyncio.sleep(0.05)
        assert session.suspicion
        before = session.path.now.heldout_lsb
        await session.add(session.suspicion.suspects[0])
        after = session.path.now.heldout_lsb
        assert None not in (before, after)
        assert after < 0.2 * before
        there = await session.picture(View(), "residual")
        ask = session.hands.ask
        monkeypatch.setattr(session.hands, "ask", None)  # the way back and forth computes nothing
        await session.walk(lambda history: history.undo())
        assert session.path.now.heldout_lsb == before
        await session.walk(lambda history: history.redo())
        assert there is not None
        assert await session.picture(View(), "residual") is there
        await session.walk(lambda history: history.undo())
        monkeypatch.setattr(session.hands, "ask", ask)
        assert session.suspicion  # known from before
        await session.toggle("drift")
        assert session.bench.file.effects[-1] == "drift"
        await session.toggle("drift")
        assert "drift" not in session.bench.file.effects
        assert {"log", "fit", "suspects", "history", "busy", "message"} <= set(said)
        session.close()

    in_thread(use())


@pytest.mark.parametrize(
    ("headers", "allowed"),
    [
        ({"host": "127.0.0.1:8642"}, True),
        ({"host": "localhost:8642", "origin": "http://localhost:8642"}, True),
        ({}, False),
        ({"host": "127.0.0.1"}, False),
        ({"host": "evil.example:8642"}, False),
        ({"host": "127.0.0.1:8642", "origin": "http://evil.example"}, False),
        ({"host": "127.0.0.1:8642", "origin": "https://127.0.0.1:8642"}, False),
        ({"host": "127.0.0.1:8642", "origin": "null"}, False),
        ({"host": "127.0.0.1:8642", "sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, False),
        ({"host": "127.0.0.1:8642", "sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, True),
    ],
)
def test_the_guard(headers, allowed):
    async def app(scope, receive, send) -> None:
        raise AssertionError("not asked")

    guard = Guard(app, 8642)
    assert guard.allows([(k.encode(), v.encode()) for k, v in headers.items()]) is allowed


@pytest.mark.parametrize("name", ["../secret.csv", "/etc/passwd", "a/../../secret.csv", "link/x.csv", "", ".", "a\0b"])
def test_no_path_leads_out_of_the_folder(tmp_path, name):
    folder = tmp_path / "bench"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    with pytest.raises(InputError, match="must be within"):
        below(folder, name)
    assert below(folder, "deep/x.csv") == folder / "deep" / "x.csv"
