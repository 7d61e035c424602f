"""The parts of a comparison, scene by scene, and their tables."""

import argparse
import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterator

import mitsuba

import convergence
import perf
import rates as rates_of
import tables
from mitsuba_scene import convert
from pbrt_file import SceneError
from rates import Rates
from renderers import Mitsuba, Pbrt, Picture, PreparedScene, Rtsl
from scene_files import SceneFile, Settings, copy_beside
from systems import Failure

# Scenes of the part `error` unless some are named.
ERROR_SCENES = 3


class Comparison:
    """The results so far."""

    def __init__(self, options: argparse.Namespace, program: Path, work: Path):
        self.options = options
        self.program = program
        self.work = work
        self.all_rates: list[Rates] = []
        self.profiles: list[perf.Profile] = []
        self.points: list[convergence.RelativePoint] = []
        self.failures: dict[str, str] = {}
        self.origin = tables.Origin(
            tables.machine(options.threads), self.software(), tables.command_line(options.folder)
        )

    def software(self) -> str:
        done = subprocess.run([self.program, "info"], capture_output=True, text=True)
        version = done.stdout.splitlines()[0] if done.stdout else "rtsl"
        llvm = re.search(r"^LLVM\s+(\S+)", done.stdout, re.MULTILINE)
        other = Path(os.environ.get("DRJIT_LIBLLVM_PATH", "libLLVM")).name
        own = f"LLVM {llvm.group(1)}" if llvm else "no LLVM"
        return f"{version} with {own}, Mitsuba {mitsuba.__version__} (llvm_ad_rgb) with {other}"

    def run(self, scenes: list[SceneFile]) -> None:
        options, width = self.options, max(len(it.name) for it in scenes) + 2
        print(f"{self.origin.software}\n{self.origin.machine}", flush=True)
        parts = set(options.parts)
        if parts & {"speed", "first"}:
            self.print_task()
            print(rates_of.header(width, bool(options.pbrt)), flush=True)
            for scene in scenes:
                self.attempt(scene, lambda it: self.measure_rates(it, width))
            self.print_summary(width)
        if "profile" in parts:
            self.run_profiles(scenes, width)
        if "error" in parts:
            for scene in scenes if options.scenes else scenes[:ERROR_SCENES]:
                self.attempt(scene, self.measure_error)

    def print_task(self) -> None:
        options = self.options
        width, height = options.size
        print(
            f"\n{width} by {height} pixels, samples: {options.samples}, "
            f"edges of a path: {options.depth}, threads: {options.threads}, turns: {options.rounds}"
        )

    def attempt(self, scene: SceneFile, action: Callable[[SceneFile], None]) -> None:
        """Does something with a scene; a failure is told in a line and does not end the others."""
        try:
            action(scene)
        except (Failure, SceneError) as failure:
            self.failures[scene.name] = " ".join(str(failure).split())
            print(f"{scene.name}: {self.failures[scene.name]}", file=sys.stderr, flush=True)

    @contextmanager
    def prepared(
        self, scene: SceneFile, size: tuple[int, int]
    ) -> Iterator[tuple[PreparedScene, list]]:
        """The copy of a scene with the settings, its conversion, and the remarks about it."""
        folder = self.work / scene.name
        folder.mkdir(exist_ok=True)
        settings = Settings(*size, self.options.depth)
        converted = folder / "scene.json"
        try:
            remarks = convert(scene.path, settings, folder, converted)
            with copy_beside(scene, settings) as copy:
                yield (
                    PreparedScene(scene.name, scene.path, copy, converted, self.options.depth),
                    remarks,
                )
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def measure_rates(self, scene: SceneFile, width: int) -> None:
        options = self.options
        with self.prepared(scene, options.size) as (prepared, remarks):
            rates = Rates(scene.name, remarks=remarks)
            task = Picture(scene.name, options.size, options.samples, 0, options.threads)
            folder = self.work / scene.name
            rtsl = Rtsl(self.program, prepared, folder)
            rival = Mitsuba(prepared, folder)
            renderers = [rtsl, rival]
            if options.pbrt:
                renderers.append(Pbrt(options.pbrt.resolve(), prepared, folder))
            try:
                if "first" in options.parts:
                    rates_of.measure_first(rtsl, rival, task, folder, rates)
                if "speed" in options.parts:
                    sheet = options.out / f"{scene.name}.png"
                    rates_of.measure_speed(renderers, task, options.rounds, folder, sheet, rates)
            finally:
                rival.close()
            self.all_rates.append(rates)
            print(rates_of.row(rates, width, bool(options.pbrt)), flush=True)

    def print_summary(self, width: int) -> None:
        for rates in self.all_rates:
            if rates.remarks:
                print(f"  {rates.scene:{width}}{'; '.join(rates.remarks)}")
        rivals = ["Mitsuba", "pbrt"] if self.options.pbrt else ["Mitsuba"]
        for rival in rivals:
            line = rates_of.summary(self.all_rates, rival)
            if line:
                print(line, flush=True)

    def run_profiles(self, scenes: list[SceneFile], width: int) -> None:
        try:
            perf.check()
        except perf.NoProfile as reason:
            print(f"\n{reason}", flush=True)
            return
        print(f"\nparts of a render's time by samples of perf\n{perf.header(width)}", flush=True)
        for scene in scenes:
            self.attempt(scene, lambda it: self.measure_profile(it, width))

    def measure_profile(self, scene: SceneFile, width: int) -> None:
        options = self.options
        folder = self.work / scene.name
        folder.mkdir(exist_ok=True)
        settings = Settings(*options.size, options.depth)
        with copy_beside(scene, settings) as copy:
            prepared = PreparedScene(
                scene.name, scene.path, copy, folder / "scene.json", options.depth
            )
            task = Picture(scene.name, options.size, options.samples, 0, options.threads)
            recorder = perf.Recorder(Rtsl(self.program, prepared, folder), folder)
            try:
                profile = recorder.profile(task)
            except perf.NoProfile as reason:
                raise Failure(str(reason)) from reason
            finally:
                shutil.rmtree(folder, ignore_errors=True)
        self.profiles.append(profile)
        print(perf.row(profile, width), flush=True)

    def measure_error(self, scene: SceneFile) -> None:
        options = self.options
        with self.prepared(scene, options.error_size) as (prepared, _):
            folder = self.work / scene.name
            task = Picture(scene.name, options.error_size, options.reference, 0, options.threads)
            pair = [Rtsl(self.program, prepared, folder), Mitsuba(prepared, folder)]
            try:
                self.points += convergence.compare_convergence(pair, task, folder)
            finally:
                pair[1].close()

    def finish(self) -> None:
        """Writes the tables, and tells the failures once more."""
        options, origin, out = self.options, self.origin, self.options.out
        width, height = options.size
        picture = f"{width} by {height} pixels, paths of {options.depth} edges"
        rivals = ["Mitsuba", "pbrt"] if options.pbrt else ["Mitsuba"]
        if any(rates.ratios() for rates in self.all_rates):
            unit = f"{picture}, {options.samples} samples; medians of {options.rounds} turns"
            tables.write_speed(self.all_rates, rivals, unit, origin, out)
        if any(rates.first_tile for rates in self.all_rates):
            unit = f"seconds from the start of the process, two threads; {picture}"
            tables.write_first(self.all_rates, unit, origin, out)
        if self.profiles:
            unit = f"parts of the render's time in per cent; {picture}"
            tables.write_profile(self.profiles, unit, origin, out)
        if self.points:
            size = "{} by {}".format(*options.error_size)
            unit = f"{size} pixels, reference: {options.reference} samples of each system"
            tables.write_error(self.points, unit, origin, out)
        tables.write_json(self.all_rates, self.profiles, self.points, origin, out)
        print(f"\ntables and pictures: {out}")
        if self.failures:
            print(f"failed: {', '.join(self.failures)}", file=sys.stderr)
