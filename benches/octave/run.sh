#!/bin/sh
# Measures the time of the thesis' method in GNU Octave (ode45, octave-ga): seconds per evaluation, one `name value` per line.
# Debian: apt-get install --no-install-recommends octave octave-ga
exec octave-cli --no-gui --quiet "$(dirname "$0")/thesis_ga.m" 2>/dev/null
