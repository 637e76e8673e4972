"""HP: the models projected into the scene by their hypothetical poses (eq. 49)."""

from __future__ import annotations

from specc_runtime.operators.vision.values import Object, ObjectModel, PoseHypothesis, label_of


def project_hypotheses(
    hypotheses: tuple[PoseHypothesis, ...], models: tuple[ObjectModel, ...]
) -> tuple[Object, ...]:
    """HP (eq. 49): for each hypothesis an object (eq. 35) in K.

    The confidence is the number of matches in the cluster over the number of the model's features.
    Objects are numbered in the order of the hypotheses.
    """
    return tuple(
        _projected(hypothesis, models[hypothesis.model], number)
        for number, hypothesis in enumerate(hypotheses)
    )


def _projected(hypothesis: PoseHypothesis, model: ObjectModel, number: int) -> Object:
    return Object(
        C_rgb=model.C_rgb.moved(hypothesis.X_KO),
        C_sift=model.C_sift.moved(hypothesis.X_KO),
        X=hypothesis.X_KO,
        confidence=hypothesis.support / len(model.C_sift.points),
        label=label_of(model.label, number),
        size=model.size,
    )
