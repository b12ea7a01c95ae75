# julia read_run.jl FOLDER: the numbers of a run's summary.json and run.h5, with the packages HDF5 and JSON.
using HDF5, JSON

folder = ARGS[1]
s = JSON.parsefile(joinpath(folder, "summary.json"))
println(s["title"], ": ", s["verdict"])
h5open(joinpath(folder, "run.h5")) do file
    t, e = read(file["time"]), read(file["energy_error"])
    println("largest energy error at a record ", maximum(abs, e), " J")
    for name in keys(file["state"])
        v = read(file["state"][name])              # numbers × records, or records
        println(name, " at ", t[end], " s: ", v isa Vector ? v[end] : v[:, end])
    end
end
