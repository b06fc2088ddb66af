"""One browser window: what is on its bench, how it came there, and the two workers that compute for it.

No widget is touched here. `on_change` is called with the part that has changed: "log", "fit", "suspects", "busy",
"history" or "message". `hands` fits and draws, which must be quick; `mind` judges, which may take its time.
"""

import asyncio
import tempfile
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from barberpole.challenge.game import Opened
from barberpole.errors import BarberpoleError, InputError, must
from barberpole.modelfile import ModelFile
from barberpole.workbench.bench import START, Bench
from barberpole.workbench.guard import below
from barberpole.workbench.history import History, Step
from barberpole.workbench.lab import Kept, Summary, without_effect
from barberpole.workbench.lab import Opened as LogOpened
from barberpole.workbench.own import Tried, with_plugin
from barberpole.workbench.pictures import Box, Chosen, Picture, View
from barberpole.workbench.rivals import Comparison
from barberpole.workbench.suspects import Suspect, Suspicion
from barberpole.workbench.worker import Stopped, Worker

TRIAL_S = 20.0  # for a user's own effect to show that it keeps its contract
HEAD_START_S = 0.3  # for the pictures, which are waited for
DRAWN = 48  # pictures that a walk along the path finds again
PATIENCE_S = 1.0  # an overtaken diagnosis that has run longer than this is stopped; a shorter one soon ends by itself

Change = Callable[[str], None]


@dataclass
class Session:
    """folder: files are read and written below it, and nowhere else; uploads and trials go to a place of its own."""

    folder: Path
    on_change: Change = lambda part: None
    hands: Worker = field(default_factory=Worker)
    mind: Worker = field(default_factory=Worker)
    history: History | None = None
    opened: LogOpened | None = None
    summary: Summary | None = None
    suspicion: Suspicion | None = None
    busy: str = ""
    thinking: bool = False
    message: str = ""
    progress: int = 0
    written: set[Path] = field(default_factory=set)
    own: tempfile.TemporaryDirectory = field(
        default_factory=lambda: tempfile.TemporaryDirectory(prefix="barberpole-workbench-")
    )

    def __post_init__(self) -> None:
        self._judged: dict[str, Suspicion] = {}
        self._fitted: dict[str, Summary] = {}
        self._drawn = Kept(DRAWN)
        self._thought: asyncio.Task | None = None
        self._since = 0.0
        self.hands.start()

    @property
    def bench(self) -> Bench:
        """What is on the bench. Raises InputError where no log is."""
        return self.path.now.bench

    @property
    def path(self) -> History:
        """The path so far. Raises InputError where no log is open."""
        if self.history is None:
            raise InputError(must("a log", "open", "none"))
        return self.history

    @property
    def noise_lsb(self) -> float | None:
        """The noise floor: the least that any diagnosis of this log has found."""
        of_this = [found.noise_lsb for found in self._judged.values() if found.noise_lsb == found.noise_lsb]
        return min(of_this, default=None)

    def close(self) -> None:
        """The window is gone."""
        if self._thought:
            self._thought.cancel()
        self.hands.close()
        self.mind.close()
        self.own.cleanup()

    async def open(self, path: Path, file: ModelFile | None = None, rest: Path | None = None) -> bool:
        """Put a log on the bench, with the model every sensor begins with. False where it cannot be read."""
        bench = Bench(path, file or ModelFile(START), rest=rest)
        opened = await self._try("reading the log", self.hands.ask("open_log", bench))
        if opened is None:
            return False
        self.history, self.opened, self.suspicion = History.begin(bench), opened, None
        self.summary, self._judged, self._fitted, self._drawn = None, {}, {}, Kept(DRAWN)
        self.on_change("log")
        await self.refresh()
        return True

    async def refresh(self) -> None:
        """Fit what is on the bench, say so, and judge it in the background. What is known is not computed again."""
        bench = self.bench
        key = bench.key
        self.suspicion = self._judged.get(key)
        self.on_change("history")
        summary = self._fitted.get(key)
        if summary is None:
            summary = await self._try("fitting", self.hands.ask("summary", bench, tick=self._tick))
        if bench != self.bench:
            return  # something newer is on the bench by now
        self.summary = summary
        if summary is None:
            self.on_change("fit")
            return
        self._fitted[key] = summary
        self.history = self.path.measured(summary.rms_lsb, summary.heldout_lsb)
        self.on_change("fit")
        self._judge(bench)

    def _tick(self, done: int) -> None:
        self.progress += done

    def _judge(self, bench: Bench) -> None:
        """Begin to look for what is missing, unless that is known."""
        if self.suspicion is not None:
            self.on_change("suspects")
            return
        now = asyncio.get_running_loop().time()
        if self.mind.busy and now - self._since > PATIENCE_S:
            self.mind.stop()
        self._since, self.thinking = now, True
        self.on_change("suspects")
        self._thought = asyncio.create_task(self._think(bench))

    async def _think(self, bench: Bench) -> None:
        try:
            await asyncio.sleep(HEAD_START_S)
            found = await self.mind.ask("suspects", bench)
        except Stopped:
            found = None
        except BarberpoleError as error:
            found = None
            self.message = str(error)
            self.on_change("message")
        if found is not None:
            self._judged[bench.key] = found
        if self.history is not None and bench == self.bench:
            self.suspicion, self.thinking = found, False
            self.on_change("suspects")

    async def add(self, suspect: Suspect) -> None:
        """Put a suspect in, in the form it was found in."""
        await self._add(suspect.effect, suspect.settings)

    async def toggle(self, effect: str) -> None:
        """Put an effect in or take it out."""
        if effect in self.bench.file.effects:
            await self.do(f"− {effect}", self.bench.with_file(without_effect(self.bench.file, effect)))
        else:
            known = [s for s in (self.suspicion.suspects if self.suspicion else ()) if s.effect == effect]
            await self._add(effect, known[0].settings if known else None)

    async def _add(self, effect: str, settings: dict | None) -> None:
        task = self.hands.ask("with_effect", self.bench, effect, settings)
        bench = await self._try(f"putting {effect} in", task)
        if bench is None:
            self.on_change("history")  # its switch goes back
            return
        await self.do(f"+ {effect}", bench)

    async def exclude(self, box: Box) -> None:
        """Leave the rows within a box out."""
        bench = await self._try("leaving rows out", self.hands.ask("exclude", self.bench, box))
        if bench is not None and bench != self.bench:
            count = sum(last - first for first, last in bench.excluded)
            await self.do(f"{count} rows left out", bench)

    async def include_all(self) -> None:
        """Take all rows in again."""
        if self.bench.excluded:
            await self.do("all rows", replace(self.bench, excluded=()))

    async def do(self, label: str, bench: Bench) -> None:
        """One step further."""
        self.history = self.path.do(label, bench)
        await self.refresh()

    async def walk(self, to: Callable[[History], History]) -> None:
        """Undo, redo, or go anywhere on the path."""
        if self.history is None:
            return
        there = to(self.history)
        if there.at != self.history.at:
            self.history = there
            await self.refresh()

    async def picture(self, view: View, name: str) -> Picture | None:
        """A picture of what is on the bench; None where it could not be drawn, or something newer is there by now."""
        bench = self.bench
        key = (bench.key, name, view.of(name))
        if key not in self._drawn:
            found = await self._try("drawing", self.hands.ask("picture", bench, view, name))
            if found is None:
                return None
            self._drawn[key] = found
        found = self._drawn.get_or(key, lambda: None)
        return found if self.history is not None and bench == self.bench else None

    async def select(self, box: Box, view: View) -> Chosen | None:
        """Samples within a box."""
        return await self._try("selecting", self.hands.ask("select", self.bench, box, view))

    async def write_effect(self, name: str, text: str) -> tuple[Tried | None, str]:
        """Try a user's own effect and, where it keeps its contract, let it join the suspects; or say what is wrong.

        The file appears in the folder. One that was there before this window wrote it is not touched.
        """
        try:
            path = below(self.folder, f"{name}.py", "the file of the effect")
            if path.exists() and path not in self.written:
                raise InputError(must("the name of the effect", "that of a file not there yet", path.name))
            tried = await asyncio.wait_for(self.mind.ask("try_effect", path, text), TRIAL_S)
        except TimeoutError:
            self.mind.stop()
            return None, f"forward must end within {TRIAL_S:g} s; it was stopped"
        except BarberpoleError as error:
            return None, str(error)
        self.written.add(path)
        self._judged = {}  # it may explain what was called unexplained
        await self.do(f"wrote {name}", with_plugin(self.bench, path))
        self.opened = await self.hands.ask("open_log", self.bench)
        self.on_change("history")
        return tried, ""

    async def keep(self, task: str, name: str, *arguments) -> str:
        """Write a model, a calibration or a report into the folder; the path written, or '' with a message."""
        try:
            path = below(self.folder, name)
        except InputError as error:
            self.message = str(error)
            self.on_change("message")
            return ""
        done = await self._try(f"writing {name}", self.mind.ask(task, self.bench, path, *arguments))
        return "" if done is None else str(path)

    async def build(self, board: str, name: str) -> dict | None:
        """Build the firmware for a board into a folder below the folder; its budget."""
        try:
            folder = below(self.folder, name, "the folder of the build")
        except InputError as error:
            self.message = str(error)
            self.on_change("message")
            return None
        work = self.mind.ask("build_firmware", self.bench, board, folder, self.attempts)
        return await self._try("building the firmware", work)

    @property
    def attempts(self) -> list[Step]:
        """The steps that led here."""
        return [self.path.steps[at] for at in self.path.trail()]

    async def compare(self, other: int) -> Comparison | None:
        """The model on the bench against that of another step, on held-out stretches."""
        there = replace(self.path.steps[other].bench, excluded=self.bench.excluded)
        return await self._try("comparing", self.hands.ask("rivals", self.bench, there))

    async def truth(self, folder: Path, opened: Opened) -> list[float]:
        """Held-out error of a trial's first model, then with each effect that was hidden."""
        return await self._try("fitting the truth", self.mind.ask("truth", folder, opened)) or []

    def cancel(self) -> None:
        """Stop whatever is being computed."""
        self.hands.stop()
        self.mind.stop()
        self.thinking = False
        self.on_change("suspects")

    async def _try(self, what: str, work: Awaitable):
        """What the work gives, or None with a message."""
        self.busy, self.progress = what, 0
        self.on_change("busy")
        try:
            return await work
        except Stopped:
            self.message = f"stopped while {what}"
        except BarberpoleError as error:
            self.message = str(error)
        finally:
            self.busy = ""
            self.on_change("busy")
        self.on_change("message")
        return None
