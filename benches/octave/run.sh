#!/bin/sh
# Times the lab's way (GNU Octave, ode45, octave-ga): seconds per evaluation, one `name value` a line.
# Debian: apt-get install --no-install-recommends octave octave-ga
exec octave-cli --no-gui --quiet "$(dirname "$0")/thesis_ga.m" 2>/dev/null
