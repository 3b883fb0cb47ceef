# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_cbvh_global_optspecs
    string join \n h/help V/version
end

function __fish_cbvh_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_cbvh_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_cbvh_using_subcommand
    set -l cmd (__fish_cbvh_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c cbvh -n "__fish_cbvh_needs_command" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_needs_command" -s V -l version -d 'Print version'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "bake" -d 'Bake meshes into a .cbvh file'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "dump" -d 'Show what a .cbvh file contains'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "validate" -d 'Check the structure and the checksums of a whole .cbvh file'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "verify" -d 'Check that a .cbvh file has the triangles of a mesh and that every bound contains its triangles'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "query" -d 'Check whether and where two meshes touch, how far apart they are, and whether one is inside the other'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "motion" -d 'Check whether a motion between two poses is free at every moment, and find when it first touches'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "probe" -d 'Compute how far points are from a mesh and which of them are inside it, and find what rays and segments hit'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "scene" -d 'Find which of many placed meshes touch, or how far apart they are'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "robot" -d 'Check a robot by the values of its joints: whether it touches itself or obstacles, how near it comes, and which motions are free'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "clash" -d 'Find the parts of an assembly that touch, overlap, contain or come near each other, and how deep or how near'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "view" -d 'Write a page that shows meshes, a motion or a scene in a browser, and runs queries there'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "suite" -d 'Run the queries of the public suite (spec/suite), one line in and one line out'
complete -c cbvh -n "__fish_cbvh_needs_command" -f -a "report" -d 'Measure speed against error on your own meshes: for each layout, or for ways to check motions'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -s o -l output -d 'The file to write; for a folder of meshes, the folder to write to' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l manifest -d 'Bake many assets: a file with one JSON object per line, with "input", "output" and options' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l out-manifest -d 'With --manifest or a folder: write the result of each asset here, one JSON object per line' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l shard -d 'With --manifest or a folder: bake only every N-th asset, starting with the I-th; I is from 1 to N' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l effort -d 'Time spent on a better tree: quick or default. Results are the same' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l max-error -d 'With --triangles quantized: how far a vertex may move, in mesh units [default: 1e-5 of the diagonal]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l weld -d 'Weld the vertices of each object: move each to the first vertex within this distance of it, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l max-memory -d 'Stay within this much memory, such as 512MiB or 2GB; the rest goes to scratch files' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l scratch -d 'With --max-memory: the folder for scratch files [default: the folder of the output]' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l jobs -d 'The number of threads [default: one per core]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l radius -d 'Give the mesh a radius, in mesh units: it stands for all points this near to it, as each point of a cloud does for a ball' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l allow-outside -d 'Let glTF files name buffers outside their own folders, which is otherwise refused'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l split-objects -d 'Build one tree per object of the input, so that queries can name an object'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l scene -d 'Bake a scene, with one tree per object: the nodes of glTF and COLLADA files become instances that share their meshes'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l drop-nan -d 'Leave out points without a position, those with a coordinate that is nan or infinite, which are otherwise refused'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l solid -d 'Make the mesh solid: what is inside touches it. All its objects must be closed'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l no-ids -d 'Leave out the original triangle numbers'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l no-topology -d 'Do not store which objects are closed, which queries about the inside of a mesh need'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l force -d 'Bake even if the output is up to date'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -l json -d 'Print one JSON object, and one per stage on standard error'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -s q -l quiet -d 'Print nothing but errors, warnings, and the object of --json'
complete -c cbvh -n "__fish_cbvh_using_subcommand bake" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand dump" -l treelet -d 'Decode this treelet: the links and slabs of its children' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand dump" -l page -d 'Decode this page: its anchors, its links to other pages, its treelets' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand dump" -l max-memory -d 'Stay within this much memory, such as 64MiB' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand dump" -l json -d 'Print one JSON object'
complete -c cbvh -n "__fish_cbvh_using_subcommand dump" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand validate" -l max-memory -d 'Stay within this much memory, such as 64MiB' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand validate" -l limit -d 'How many of these pairs to list, the first ones by object and triangle' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand validate" -l self-contacts -d 'Find all pairs of triangles that meet where they should not; this maps the file'
complete -c cbvh -n "__fish_cbvh_using_subcommand validate" -l json -d 'Print one JSON object'
complete -c cbvh -n "__fish_cbvh_using_subcommand validate" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand verify" -l max-memory -d 'Stay within this much memory, such as 64MiB; the rest goes to scratch files' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand verify" -l scratch -d 'The folder for scratch files [default: the system\'s folder for temporary files]' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand verify" -l allow-outside -d 'Let glTF files name buffers outside their own folders, as for bake'
complete -c cbvh -n "__fish_cbvh_using_subcommand verify" -l json -d 'Print one JSON object'
complete -c cbvh -n "__fish_cbvh_using_subcommand verify" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l mode -d 'The query' -r -f -a "collide\t'Do they touch? This is about surfaces: a mesh inside another does not touch it; relation finds it'
contacts\t'How many pairs of triangles touch?'
distance\t'How far apart are they?'
within\t'Are they at most --within apart?'
relation\t'Do they touch and, if not, is one inside the other?'
penetration\t'How deep do they overlap, and which translation of B ends that?'
signed\t'How far apart are they or, below zero, how deep do they overlap?'"
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l within -d 'With --mode within: the distance to compare with, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l rel-err -d 'With --mode distance: the result may exceed the least distance by this fraction of it' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l abs-err -d 'With --mode distance: the result may exceed the least distance by this length, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l isa -d 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l jobs -d 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l budget -d 'Stop after this many seconds, for each file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l warm -d 'Untimed queries before the timed ones, taken from the end of the file' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l limit -d 'Run only the first N queries of each file; 0 runs all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l object -d 'Query only the object of this name, in each mesh that has one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l out -d 'Write raw results and times to this file; %s stands for the name of the file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l read-ahead -d 'How the system reads .cbvh files from the disk' -r -f -a "usual\t'As the system chooses: some pages around each page that is touched'
sparse\t'Only the pages that queries touch'
whole\t'The whole file, in the background'"
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l pose -d 'Query one pose, given as 12 numbers, and print the result for a person' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l witness -d 'With --mode distance about one pose: write both closest triangles and the segment between them as OBJ' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l json -d 'Print one JSON object per query, with everything that the result has'
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -l bench -d 'Print one JSON object per file, with the times of its queries, and no results'
complete -c cbvh -n "__fish_cbvh_using_subcommand query" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l clearance -d 'Meshes that are at most this far apart count as a hit, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l tolerance -d 'How far beyond the clearance the result may be near, in mesh units [default: 1e-6 of the smaller diagonal]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l isa -d 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l jobs -d 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l budget -d 'Stop after this many seconds, for each file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l warm -d 'Untimed queries before the timed ones, taken from the end of the file' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l limit -d 'Run only the first N queries of each file; 0 runs all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l object -d 'Query only the object of this name, in each mesh that has one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l out -d 'Write raw results and times to this file; %s stands for the name of the file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l read-ahead -d 'How the system reads .cbvh files from the disk' -r -f -a "usual\t'As the system chooses: some pages around each page that is touched'
sparse\t'Only the pages that queries touch'
whole\t'The whole file, in the background'"
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l motion -d 'Query one motion, given as 24 numbers, and print the result for a person' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l witness -d 'With --motion: write the closest triangles at a hit and the segment between them as OBJ' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l json -d 'Print one JSON object per query, with everything that the result has'
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -l bench -d 'Print one JSON object per file, with the times of its queries, and no results'
complete -c cbvh -n "__fish_cbvh_using_subcommand motion" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l mode -d 'The query' -r -f -a "closest\t'How far is the mesh from a point?'
side\t'Is a point inside the mesh, on it or outside?'
ray\t'Where does a ray first hit the mesh?'
segment\t'Does a segment meet the mesh?'"
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l isa -d 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l jobs -d 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l budget -d 'Stop after this many seconds, for each file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l warm -d 'Untimed queries before the timed ones, taken from the end of the file' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l limit -d 'Run only the first N queries of each file; 0 runs all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l object -d 'Query only the object of this name, in each mesh that has one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l out -d 'Write raw results and times to this file; %s stands for the name of the file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l read-ahead -d 'How the system reads .cbvh files from the disk' -r -f -a "usual\t'As the system chooses: some pages around each page that is touched'
sparse\t'Only the pages that queries touch'
whole\t'The whole file, in the background'"
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l probe -d 'Query one point, ray or segment, given as 3 or 6 numbers, and print the result for a person' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l json -d 'Print one JSON object per query, with everything that the result has'
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -l bench -d 'Print one JSON object per file, with the times of its queries, and no results'
complete -c cbvh -n "__fish_cbvh_using_subcommand probe" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l mode -d 'The query' -r -f -a "collide\t'Does any pair touch?'
pairs\t'Which pairs touch?'
distance\t'How far apart is the nearest pair?'
within\t'Which pairs are at most --within apart?'
relation\t'Which pairs touch, or have one inside the other?'"
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l within -d 'With --mode within: the distance to compare with, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l isa -d 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l jobs -d 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l budget -d 'Stop after this many seconds, for each file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l warm -d 'Untimed queries before the timed ones, taken from the end of the file' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l limit -d 'Run only the first N queries of each file; 0 runs all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l out -d 'Write raw results and times to this file' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l json -d 'Print one JSON object per query, with everything that the result has'
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l list -d 'Print the pairs of each frame for a person, with their names'
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -l bench -d 'Print one JSON object about all frames, with their times, and no results'
complete -c cbvh -n "__fish_cbvh_using_subcommand scene" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l srdf -d 'An SRDF file, whose disabled pairs are not checked' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l package-dir -d 'A folder that contains packages, for package:// paths of the URDF; may be given several times' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l obstacle -d 'A mesh that stands in the world, and its pose there; may be given several times' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l mode -d 'The query' -r -f -a "collide\t'Do any two bodies touch?'
distance\t'How far apart are the nearest two bodies?'
near\t'Which bodies are near, how far apart are they, and how does that change with the joint values?'"
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l margin -d 'With --mode near: bodies that are at most this far apart are near, in metres' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l clearance -d 'With --edges: bodies that are at most this far apart count as a hit, in metres' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l tolerance -d 'With --edges: how far beyond the clearance the result may be near, in metres [default: 1e-6 of the smaller shape\'s diagonal]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l isa -d 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l jobs -d 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l budget -d 'Stop after this many seconds, for each file of queries' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l warm -d 'Untimed queries before the timed ones, taken from the end of the file' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l limit -d 'Run only the first N queries of each file; 0 runs all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l out -d 'Write raw results and times to this file' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l joints -d 'Check one configuration (with --edges: one edge), given as a line of FILE, and print the result for a person' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l view -d 'Write a page that shows the robot, with a slider for each joint value' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l max-page -d 'The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l allow-outside -d 'Let the URDF name meshes outside of its package, of the folder above it and of --package-dir'
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l solid -d 'Obstacles are full: what is inside touches them. Their meshes must be closed'
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l edges -d 'Check edges: straight motions of all joint values between two configurations'
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l json -d 'Print one JSON object per query, with everything that the result has'
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -l bench -d 'Print one JSON object about all lines, with their times, and no results'
complete -c cbvh -n "__fish_cbvh_using_subcommand robot" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l manifest -d 'Read the files of parts, their names and poses from this file, one JSON object per line' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l shard -d 'Check only the pairs whose earlier part is every N-th one, starting with the I-th; I is from 1 to N' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l clearance -d 'Also find parts that are at most this far apart, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l tolerance -d 'How far apart or how deep in each other parts may be and count as touching, in mesh units [default: a millionth of the assembly\'s diagonal]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l visits -d 'The most visits of the search for the depth of a pair' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l round -d 'Coordinates of meshes: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l sort -d 'The order of the list: class, or volume, which also measures' -r -f -a "class\t''
volume\t''"
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l min-volume -d 'Leave out clashes of parts that have less than this volume in common, in cubic mesh units; measures as well' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l baseline -d 'Compare with what --json printed earlier' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l fail-on -d 'Exit with code 5 if there is a clash of these classes, separated by commas; with --baseline, a new or changed one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l csv -d 'Write the clashes to this file as comma-separated values' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l bcf -d 'Write the clashes to this file as topics of BCF 2.1' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l view -d 'Write a page that shows the parts and their clashes' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l max-page -d 'The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l limit -d 'The most clashes to list for a person; 0 lists all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l isa -d 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l jobs -d 'The number of threads [default: one per core]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l magnitudes -d 'Also measure what parts have in common: volume, areas, box, and how thick a part is where another one pierces it'
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l split-objects -d 'Make each object of a mesh file a part'
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -l json -d 'Print one JSON object with all clashes'
complete -c cbvh -n "__fish_cbvh_using_subcommand clash" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l pose -d 'Place B in the frame of A by 12 numbers [default: both are in one frame]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l within -d 'Also show whether A and B are at most this far apart, in mesh units' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l motion -d 'Move B from one pose to another, given as 24 numbers' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l clearance -d 'With --motion: meshes that are at most this far apart count as a hit, in mesh units [default: 0]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l tolerance -d 'With --motion: how far beyond the clearance the result may be near [default: 1e-6 of the smaller diagonal]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l scene -d 'Show a scene file, or a .cbvh file made by cbvh bake --scene, and the frames of a file' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l object -d 'Show only the object of this name, in each mesh that has one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l profile -d 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l triangles -d 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l round -d 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -s o -l output -d 'The page to write; without it, the browser opens a page in the temporary folder' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -l max-page -d 'The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand view" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand suite" -l isa -d 'Instruction set of the queries: auto, scalar, avx2, avx512, neon or simd128' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand suite" -l effort -d 'Time spent on a better tree: quick or default. Results are the same' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand suite" -s h -l help -d 'Print help'
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l out -d 'The folder to write to; it is created if it does not exist' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l meshes -d 'The folder of the meshes [default: that of PAIRS]' -r -F
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l poses -d 'Files of poses for each pair, besides those in PAIRS; %s stands for the pair\'s name' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l motions -d 'Report on motions instead of layouts. FILEs are files of motions for each pair, besides those in PAIRS; %s stands for the pair\'s name' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l limit -d 'The largest number of poses or motions per pair, spread evenly over all; 0 takes all' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l rounds -d 'Rounds in which all layouts, or all ways to check, take turns' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l isa -d 'Backend: auto, scalar, avx2, avx512, neon or simd128; auto is the fastest one of this CPU, unless CBVH_ISA names one' -r
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -l quick -d 'Take only ten poses or motions in two rounds: good for trying the command, too few to quote'
complete -c cbvh -n "__fish_cbvh_using_subcommand report" -s h -l help -d 'Print help'
