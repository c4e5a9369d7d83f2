% Measures the time of the thesis' method in GNU Octave: the network (eqs 13-16), integrated with ode45, in a genetic algorithm (octave-ga).
%
%   octave-cli --no-gui --quiet thesis_ga.m        (Debian: apt-get install octave octave-ga)
%
% A whole run of 100,000 evaluations takes an hour or more; this times a few evaluations and a small population for two
% generations, and prints seconds per evaluation, one `name value` per line. `cargo xtask bench host` runs it.
1;

function dy = field(y, g, q)
  % y: a1..a4, z1..z4; g: k12 k21 k34 k43 k13 k24 k31 k42 alpha1..4; q: p, mu, a0.
  x = y(1:4) - q.a0;
  z = y(5:8);
  dz = g(9:12) .* (1 - q.p .* z.^2) .* z - q.mu.^2 .* x ...
     + g(1:4) .* (z - z([2 1 4 3])) ...
     + g(5:8) .* z([3 4 1 2]) .* x([3 4 1 2]);
  dy = [z; dz];
end

function j = cost(g, q, t, target, start, options)
  global calls;
  calls += 1;
  [~, y] = ode45(@(t, y) field(y, g(:), q), t, start, options);
  if rows(y) < numel(t)
    j = Inf;
  else
    j = mean(mean((y(:, 1:4) - target).^2));
  end
end

global calls;
calls = 0;
truth = [0.2010; 0.2010; 0.3012; 0.3012; 0.0125; 0.0129; 0.0125; 0.0129; 0.0014; 0.0020; 0.0108; 0.0108];
w = 2*pi/1.1;
amplitude = [20; 20; 30; 30];
q.mu = w*ones(4, 1);
q.a0 = [5; 5; 30; 30];
q.p = 4*(truth(9:12) + 2*truth(1:4)) ./ (3*truth(9:12).*(w*amplitude).^2);
start = [25; -15; 45; 15; 0; 0; 100; -100];
t = 0:0.005:5;

default = odeset();
tight = odeset('RelTol', 1e-6, 'AbsTol', 1e-6);
[~, y] = ode45(@(t, y) field(y, truth, q), t, start, odeset('RelTol', 1e-10, 'AbsTol', 1e-10));
target = y(:, 1:4);

count = 10;
for kind = {{'ode45_default', default}, {'ode45_1e-6', tight}}
  cost(truth, q, t, target, start, kind{1}{2});
  times = zeros(count, 1);
  for k = 1:count
    tic;
    cost(truth .* (0.9 + 0.02*k), q, t, target, start, kind{1}{2});
    times(k) = toc;
  end
  printf('%s %.6f\n', kind{1}{1}, median(times));
end

% The thesis' genes within the ranges of gait-fit's search: gains 0 to 1 1/s and 0 to 0.05 1/(deg s), alpha 0 to 0.05 1/s.
pkg load ga;
high = [ones(1, 4), 0.05*ones(1, 8)];
options = gaoptimset('PopulationSize', 20, 'Generations', 2, 'PopInitRange', [zeros(1, 12); high], 'EliteCount', 2, ...
                     'CrossoverFraction', 0.99);
rand('twister', 1);
randn('twister', 1);
calls = 0;
tic;
ga(@(g) cost(g, q, t, target, start, default), 12, [], [], [], [], zeros(1, 12), high, [], options);
printf('ode45_in_ga %.6f\n', toc/calls);
