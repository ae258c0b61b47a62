"""Following curves of periodic responses: arclength steps, branches, resonance peaks, rescue, several states."""
