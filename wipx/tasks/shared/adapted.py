"""The simulation of a method, adapted to the trials of a target: what is judged, trained with and compared."""

from fnmatch import fnmatch

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.identify.adaptation import AdaptationProblem, Adapted, LoadedTrials, adaptation
from wipx.identify.method import Method
from wipx.identify.objectives import PaperTrajectories
from wipx.library import feedback_of
from wipx.recordings.model_file import read_model
from wipx.recordings.robot_file import RobotDescription
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import SearchProgress

UNLOADED = "unloaded"


def loaded_trials(source: RecordingSource) -> LoadedTrials:
    """The trials in a folder, with their loads and their controller.

    Raises:
        InputError: the folder is at fault, or its robot.yaml has no controller.
    """
    robot = source.describe()
    feedback = feedback_of(robot)
    if feedback is None:
        raise InputError(
            f"{source.place}: the loop is closed in simulation; add the robot's `controller` to robot.yaml"
        )
    recordings = source.load_all()
    names = tuple(_class_of(robot, r.name) for r in recordings)
    return LoadedTrials(recordings, names, source.loads(recordings), feedback)


def adaptation_problem(
    job: Job, source: RecordingSource, trials: LoadedTrials, held_out: tuple[str, ...]
) -> AdaptationProblem:
    """The problem of the chosen method.

    Args:
        job: Has method, nominal plant, friction, effects, simulator, objective and bounds.
        source: Where the trials come from.
        trials: What is in it.
        held_out: Names of loads that no search sees.

    Raises:
        InputError: the objective is not the paper's, a model of model.path is missing or belongs to another plant, or
            see `wipx.identify.adaptation.adaptation`.
    """
    objective = job.part("objective")
    if not isinstance(objective, PaperTrajectories):
        raise InputError(
            f"task={job.chosen.get('task')} matches trajectories as the paper does; choose objective=paper"
        )
    method: Method = job.part("method")
    nominal = _start(job, job.part("plant").nominal(source.describe().model), completed=method.completes)
    switched_on = method.switched_on(nominal, job.part("friction"), job.effects)
    return adaptation(nominal, switched_on, trials, held_out, job.part("sim"), objective, job.bounds)


def adapted_simulation(job: Job, problem: AdaptationProblem, draws: int) -> Adapted:
    """The simulation that the chosen method makes of it: nominal, optimised, or `draws` random ones."""
    method: Method = job.part("method")
    rng = np.random.default_rng(job.seed)
    if method.values == "nominal":
        return problem.nominal_only()
    if method.values == "random":
        return problem.random(draws, method.reach, rng)
    with SearchProgress("adapt") as progress:
        return problem.optimised(job.part("optimizer"), rng, progress)


def _start(job: Job, nominal: Model, *, completed: bool) -> Model:
    """What a method starts from: the nominal model, or one that was completed before."""
    if completed != (job.model_path is not None):
        remedy = "give model.path=FOLDER/model.yaml of task=diagnose" if completed else "choose method=diagnosed for it"
        raise InputError(f"method={job.chosen.get('method')}: model.path is {job.model_path or 'not given'}; {remedy}")
    if job.model_path is None:
        return nominal
    model = read_model(job.model_path)
    if model.plant != nominal.plant:
        raise InputError(
            f"{job.model_path}: a model of plant {model.plant.kind}, expected {nominal.plant.kind} like the target; "
            "give the model of this robot"
        )
    return model


def _class_of(robot: RobotDescription, recording: str) -> str:
    """Name of the load in a recording."""
    return next((name for name, known in robot.loads.items() if fnmatch(recording, known.recordings)), UNLOADED)
