"""An Open Job Description of a job: frames by ranges of samples, then what makes frames of them.

Written for the specification jobtemplate-2023-09 without extensions. Every session of the job has one Blender, which
the job's environment starts and ends; what a farm changes for another shot are the job's parameters.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from .tasks import Job, spans

LONGEST_NAME = 128  # characters of a job's

_HEAD = """\
# Render with ReSTIR. Check and try it here:
#     openjd check {file}
#     openjd run {file}
specificationVersion: jobtemplate-2023-09
name: {title}
parameterDefinitions:
  - name: SceneFile
    type: PATH
    objectType: FILE
    dataFlow: IN
    description: The .blend. What it needs beside itself has to be where it looks for it.
{scene}  - name: OutputFolder
    type: PATH
    objectType: DIRECTORY
    dataFlow: OUT
    description: Where frames are written, and ranges of samples until they are merged.
{folder}  - name: OutputName
    type: STRING
    description: What the name of a frame's file begins with.
    default: {name}
  - name: Frames
    type: STRING
    description: Such as 1-10,20 or 1-100:5.
    default: {frames}
{samples}  - name: {program}
    type: STRING
    description: {program_text}
    default: {path}
jobEnvironments:
  - name: Blender
    description: One Blender a session, which keeps the file open from task to task.
    script:
      actions:
        onEnter:
          command: "{{{{Param.{program}}}}}"
          args: {start}
          timeout: 1800
        onExit:
          command: "{{{{Param.{program}}}}}"
          args: {stop}
          timeout: 120
steps:
{steps}"""

_SAMPLES = """\
  - name: Samples
    type: INT
    minValue: 1
    description: Of a frame.
    default: {samples}
  - name: SamplesPerTask
    type: INT
    minValue: 1
    default: {per_task}
"""

_STEP = """\
  - name: {name}
{dependencies}    parameterSpace:
      taskParameterDefinitions:
        - name: Frame
          type: INT
          range: "{{{{Param.Frames}}}}"
{first}    script:
      actions:
        onRun:
          command: "{{{{Param.{program}}}}}"
          args: {run}
"""

_FIRST = """\
        - name: First
          type: INT
          range: "1-{{Param.Samples}}:{{Param.SamplesPerTask}}"
"""

_AFTER = """\
    dependencies:
      - dependsOn: Render
"""


def write(path: Path, text: str) -> None:
    """Write a template, whole."""
    unfinished = path.with_name(f"{path.name}.new")
    unfinished.write_text(text, "utf-8")
    os.replace(unfinished, path)


def template(job: Job, frames: list[int], samples: int, blender: str, file: Path) -> str:
    """The template of a job that has these frames and samples by default, for a file.

    blender: the command of a Blender that has the extension; "": a Python that has this package and bpy.
    """
    program = "Blender" if blender else "Python"
    before = ["--background", "--command", "restir_farm"] if blender else ["-m", "restir_engine.farm.service"]
    here = ["--session", "{{Session.WorkingDirectory}}"]
    ranges = 0 < job.samples_per_task < samples
    start = [*before, "start", *here, "--scene", "{{Param.SceneFile}}", "--engine", job.engine]
    start += ["--output", "{{Param.OutputFolder}}/{{Param.OutputName}}"]
    start += ["--samples", "{{Param.Samples}}", "--samples-per-task", "{{Param.SamplesPerTask}}"] if ranges else []
    start += ["--enable-autoexec"] if job.scripts else []
    run = [*before, "run", *here, "--frame", "{{Task.Param.Frame}}"]

    def step(name: str, arguments: list[str], first: str = "", dependencies: str = "") -> str:
        return _STEP.format(
            name=name, program=program, first=first, dependencies=dependencies, run=json.dumps(arguments)
        )

    if ranges:
        first = _FIRST
        steps = step("Render", [*run, "--first", "{{Task.Param.First}}"], first)
        steps += step("Finish", [*run, "--finish"], dependencies=_AFTER)
    else:
        steps = step("Render", run)
    folder, name = os.path.split(job.output)
    return _HEAD.format(
        file=file.name,
        title=json.dumps(f"ReSTIR {os.path.basename(job.scene)}"[:LONGEST_NAME]),
        scene=_default(job.scene, file),
        folder=_default(folder, file),
        name=json.dumps(name),
        frames=json.dumps(spans(frames)),
        samples=_SAMPLES.format(samples=samples, per_task=job.samples_per_task) if ranges else "",
        program=program,
        program_text="The Blender that has the extension." if blender else "The Python that has this package and bpy.",
        path=json.dumps(blender or "python"),
        start=json.dumps(start),
        stop=json.dumps([*before, "stop", *here]),
        steps=steps,
    )


def _default(path: str, file: Path) -> str:
    """The line by which a path below the template's folder is a parameter's default; there can be no others."""
    found = Path(os.path.relpath(path, file.absolute().parent))
    return "" if found.is_absolute() or ".." in found.parts else f"    default: {json.dumps(found.as_posix())}\n"
