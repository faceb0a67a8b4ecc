{{/* Names, labels, and what several objects share. */}}

{{- define "osteon.name" -}}
{{- default .Chart.Name .Values.nameOverride | trunc 40 | trimSuffix "-" -}}
{{- end -}}

{{/* The release's name once, where it contains the chart's; short enough for the suffixes of names. */}}
{{- define "osteon.fullname" -}}
{{- $name := default .Chart.Name .Values.nameOverride -}}
{{- if .Values.fullnameOverride -}}
{{- .Values.fullnameOverride | trunc 40 | trimSuffix "-" -}}
{{- else if contains $name .Release.Name -}}
{{- .Release.Name | trunc 40 | trimSuffix "-" -}}
{{- else -}}
{{- printf "%s-%s" .Release.Name $name | trunc 40 | trimSuffix "-" -}}
{{- end -}}
{{- end -}}

{{- define "osteon.coordinatorName" -}}{{ include "osteon.fullname" . }}-coordinator{{- end -}}
{{- define "osteon.workerName" -}}{{ include "osteon.fullname" . }}-worker{{- end -}}

{{/* Labels that never change, by which objects find pods. Call with (list $ "component"). */}}
{{- define "osteon.selector" -}}
{{- $root := index . 0 -}}
app.kubernetes.io/name: {{ include "osteon.name" $root }}
app.kubernetes.io/instance: {{ $root.Release.Name }}
app.kubernetes.io/component: {{ index . 1 }}
{{- end -}}

{{- define "osteon.labels" -}}
{{- $root := index . 0 -}}
{{ include "osteon.selector" . }}
app.kubernetes.io/version: {{ $root.Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ $root.Release.Service }}
helm.sh/chart: {{ printf "%s-%s" $root.Chart.Name $root.Chart.Version | replace "+" "_" }}
{{- with $root.Values.labels }}
{{ toYaml . }}
{{- end }}
{{- end -}}

{{- define "osteon.serviceAccountName" -}}
{{- if .Values.serviceAccount.create -}}
{{- default (include "osteon.fullname" .) .Values.serviceAccount.name -}}
{{- else -}}
{{- default "default" .Values.serviceAccount.name -}}
{{- end -}}
{{- end -}}

{{- define "osteon.image" -}}
{{- $tag := default .Chart.AppVersion .Values.image.tag -}}
{{- if .Values.image.digest -}}
{{- printf "%s@%s" .Values.image.repository .Values.image.digest -}}
{{- else -}}
{{- printf "%s:%s" .Values.image.repository $tag -}}
{{- end -}}
{{- end -}}

{{- define "osteon.scheme" -}}{{ ternary "https" "http" .Values.tls.enabled }}{{- end -}}

{{/* The URL at which pods reach the coordinator; its host must be in the coordinator's certificate. */}}
{{- define "osteon.url" -}}
{{ include "osteon.scheme" . }}://{{ include "osteon.coordinatorName" . }}.{{ .Release.Namespace }}.svc:{{ .Values.coordinator.service.port }}
{{- end -}}

{{/* What the pods of coordinator, workers and the test have in common. */}}
{{- define "osteon.podBasics" -}}
serviceAccountName: {{ include "osteon.serviceAccountName" . }}
# No program of osteon calls the API of Kubernetes.
automountServiceAccountToken: false
enableServiceLinks: false
{{- with .Values.imagePullSecrets }}
imagePullSecrets:
  {{- toYaml . | nindent 2 }}
{{- end }}
securityContext:
  runAsNonRoot: true
  runAsUser: 65532
  runAsGroup: 65532
  # The group that may read the files of the Secrets and write to the store's volume.
  fsGroup: 65532
  fsGroupChangePolicy: OnRootMismatch
  seccompProfile:
    type: RuntimeDefault
{{- end -}}

{{- define "osteon.containerBasics" -}}
image: {{ include "osteon.image" . | quote }}
imagePullPolicy: {{ .Values.image.pullPolicy }}
securityContext:
  allowPrivilegeEscalation: false
  readOnlyRootFilesystem: true
  capabilities:
    drop: [ALL]
{{- end -}}

{{/* Where a pod runs. Call with the values of the component. */}}
{{- define "osteon.scheduling" -}}
{{- with .priorityClassName }}
priorityClassName: {{ . }}
{{- end }}
{{- with .nodeSelector }}
nodeSelector:
  {{- toYaml . | nindent 2 }}
{{- end }}
{{- with .tolerations }}
tolerations:
  {{- toYaml . | nindent 2 }}
{{- end }}
{{- with .affinity }}
affinity:
  {{- toYaml . | nindent 2 }}
{{- end }}
{{- end -}}

{{/* Files of a Secret, under fixed names. Mode 0440: a key that others can read is refused. */}}
{{- define "osteon.tlsVolume" -}}
- name: tls
  secret:
    secretName: {{ .secretName }}
    defaultMode: 0440
    items:
      - key: {{ .keys.ca }}
        path: ca.pem
      - key: {{ .keys.certificate }}
        path: certificate.pem
      - key: {{ .keys.key }}
        path: key.pem
{{- end -}}

{{- define "osteon.coordinatorProbe" -}}
exec:
  command:
    - /usr/bin/osteon
    - coordinator
    - health
    - --coordinator
    - {{ include "osteon.scheme" . }}://{{ .Values.coordinator.probeHost }}:7000
    {{- if .Values.tls.enabled }}
    - --tls-ca
    - /etc/osteon/tls/ca.pem
    {{- end }}
    - --timeout
    - "4"
timeoutSeconds: 5
{{- end -}}

{{/* How fast the number of workers changes. Up at once; down only once fewer have been enough for a while. */}}
{{- define "osteon.scaling" -}}
scaleUp:
  stabilizationWindowSeconds: 0
scaleDown:
  stabilizationWindowSeconds: {{ .scaleDownSeconds }}
{{- end -}}

{{/* What the schema cannot say, because it relates values to each other. */}}
{{- define "osteon.checks" -}}
{{- $a := .Values.worker.autoscaling -}}
{{- if and (ne $a.kind "none") (gt (int $a.minReplicas) (int $a.maxReplicas)) -}}
{{- fail (printf "worker.autoscaling.minReplicas is %d, and must not exceed maxReplicas, which is %d" (int $a.minReplicas) (int $a.maxReplicas)) -}}
{{- end -}}
{{- $host := .Values.coordinator.probeHost -}}
{{- $name := include "osteon.coordinatorName" . -}}
{{- if or (eq $host $name) (hasPrefix (printf "%s." $name) $host) -}}
{{- fail (printf "coordinator.probeHost is %s, the service, which leads to no pod before the probes succeed; use localhost or %s-0" $host $name) -}}
{{- end -}}
{{- $service := .Values.coordinator.service -}}
{{- if and $service.loadBalancerSourceRanges (ne $service.type "LoadBalancer") -}}
{{- fail (printf "coordinator.service.loadBalancerSourceRanges is given, but coordinator.service.type is %s; set it to LoadBalancer" $service.type) -}}
{{- end -}}
{{- end -}}
