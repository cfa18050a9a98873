"""throughput -> whether a path goes on.  The limits below which chance decides."""

from ..arrays import F32

# A path whose throughput falls below this goes on with the probability throughput / FAINT; where
# the eye sees a surface, directly or in mirrors and glass, paths may become fainter.  Measured on
# the examples: variance x time is least around here.
FAINT, FAINT_IN_VIEW = F32(0.25), F32(0.1)
