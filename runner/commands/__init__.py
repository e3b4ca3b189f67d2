"""The commands of the command line, in the order in which ``epicycle --help`` names them."""

from . import compare, completion, describe, disturb, explain, fit, imports, new, rare, run, show, studies, trace, view

COMMANDS = (
    run.run,
    view.view,
    compare.compare,
    explain.explain,
    rare.rare,
    fit.fit,
    disturb.disturb,
    studies.study,
    studies.resume,
    studies.status,
    studies.replay,
    studies.report,
    trace.trace,
    describe.validate,
    show.show,
    describe.graph,
    describe.models,
    describe.actors,
    describe.aspects,
    describe.schema,
    imports.import_,
    new.new,
    completion.completion,
)

__all__ = ["COMMANDS"]
