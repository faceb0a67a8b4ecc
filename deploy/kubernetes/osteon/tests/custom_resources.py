"""Schemas of the two custom resources that the chart can make, as far as it uses them. Written after their
definitions in KEDA and in the Prometheus operator; fields that are not listed are refused."""

import jsonschema


def fields(required, **properties):
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": properties,
        "required": required.split(),
    }


TEXT = {"type": "string", "minLength": 1}
LABELS = {"type": "object", "additionalProperties": TEXT}
COUNT = {"type": "integer", "minimum": 0}
METADATA = fields("name namespace labels", name=TEXT, namespace=TEXT, labels=LABELS)
WINDOW = fields("stabilizationWindowSeconds", stabilizationWindowSeconds=COUNT)

SERVICE_MONITOR = fields(
    "selector endpoints",
    selector=fields("matchLabels", matchLabels=LABELS),
    endpoints={
        "type": "array",
        "minItems": 1,
        "items": fields(
            "port path interval",
            port=TEXT,
            path={"const": "/metrics"},
            interval={"type": "string", "pattern": "^[0-9]+s$"},
        ),
    },
)

SCALED_OBJECT = fields(
    "scaleTargetRef triggers",
    scaleTargetRef=fields("name", apiVersion=TEXT, kind=TEXT, name=TEXT),
    pollingInterval=COUNT,
    cooldownPeriod=COUNT,
    minReplicaCount=COUNT,
    maxReplicaCount=COUNT,
    advanced=fields(
        "horizontalPodAutoscalerConfig",
        horizontalPodAutoscalerConfig=fields("behavior", behavior=fields("", scaleUp=WINDOW, scaleDown=WINDOW)),
    ),
    triggers={
        "type": "array",
        "minItems": 1,
        "items": fields(
            "type metadata",
            type={"const": "prometheus"},
            metricType={"enum": ["AverageValue", "Value"]},
            # All are texts, numbers too.
            metadata=fields("serverAddress query threshold", serverAddress=TEXT, query=TEXT, threshold=TEXT),
        ),
    },
)

KINDS = {
    "ServiceMonitor": ("monitoring.coreos.com/v1", SERVICE_MONITOR),
    "ScaledObject": ("keda.sh/v1alpha1", SCALED_OBJECT),
}


def validate(found):
    """Fails if an object has other fields, or lacks one that is needed."""
    version, spec = KINDS[found["kind"]]
    whole = fields("apiVersion kind metadata spec", apiVersion={"const": version}, kind=TEXT, metadata=METADATA, spec=spec)
    jsonschema.Draft202012Validator(whole).validate(found)
