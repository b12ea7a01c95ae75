% read_run(FOLDER): the numbers of a run's summary.json and run.h5, in Matlab (R2021b or later) and Octave (7 or later).
% [s, t, e, q] = read_run(FOLDER): summary, times [s], energy error [J], and a struct with a row per number of each coordinate.
function [s, t, e, q] = read_run(folder)
  s = jsondecode(fileread(fullfile(folder, 'summary.json')));
  file = fullfile(folder, 'run.h5');
  if exist('OCTAVE_VERSION', 'builtin')
    r = load('-hdf5', file, 'time', 'energy_error', 'state');  % by name: it cannot read texts of any length
    [t, e, q] = deal(r.time, r.energy_error, r.state);
  else
    t = h5read(file, '/time')';
    e = h5read(file, '/energy_error')';
    q = struct();
    for d = h5info(file, '/state').Datasets'
      v = h5read(file, ['/state/' d.Name]);
      if size(v, 2) == 1, v = v'; end                          % a number at each record: as a row
      q.(matlab.lang.makeValidName(d.Name)) = v;
    end
  end
  fprintf('%s: %s\n', s.title, s.verdict);
  fprintf('largest energy error at a record %.6e J\n', max(abs(e)));
  for name = fieldnames(q)'
    v = q.(name{1});
    fprintf('%s at %.6g s:%s\n', name{1}, t(end), sprintf(' %.15g', v(:, end)));
  end
end
