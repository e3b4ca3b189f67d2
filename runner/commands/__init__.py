"""The commands of the command line, in the order in which ``epicycle --help`` names them."""

from . import describe, imports, run, studies, trace, view

COMMANDS = (
    run.run,
    view.view,
    studies.study,
    studies.resume,
    studies.status,
    studies.replay,
    studies.report,
    trace.trace,
    describe.validate,
    describe.graph,
    describe.models,
    describe.actors,
    describe.aspects,
    describe.schema,
    imports.import_,
)

__all__ = ["COMMANDS"]
