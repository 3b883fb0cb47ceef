
using namespace System.Management.Automation
using namespace System.Management.Automation.Language

Register-ArgumentCompleter -Native -CommandName 'cbvh' -ScriptBlock {
    param($wordToComplete, $commandAst, $cursorPosition)

    $commandElements = $commandAst.CommandElements
    $command = @(
        'cbvh'
        for ($i = 1; $i -lt $commandElements.Count; $i++) {
            $element = $commandElements[$i]
            if ($element -isnot [StringConstantExpressionAst] -or
                $element.StringConstantType -ne [StringConstantType]::BareWord -or
                $element.Value.StartsWith('-') -or
                $element.Value -eq $wordToComplete) {
                break
        }
        $element.Value
    }) -join ';'

    $completions = @(switch ($command) {
        'cbvh' {
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('bake', 'bake', [CompletionResultType]::ParameterValue, 'Bake meshes into a .cbvh file')
            [CompletionResult]::new('dump', 'dump', [CompletionResultType]::ParameterValue, 'Show what a .cbvh file contains')
            [CompletionResult]::new('validate', 'validate', [CompletionResultType]::ParameterValue, 'Check the structure and the checksums of a whole .cbvh file')
            [CompletionResult]::new('verify', 'verify', [CompletionResultType]::ParameterValue, 'Check that a .cbvh file has the triangles of a mesh and that every bound contains its triangles')
            [CompletionResult]::new('query', 'query', [CompletionResultType]::ParameterValue, 'Check whether and where two meshes touch, how far apart they are, and whether one is inside the other')
            [CompletionResult]::new('motion', 'motion', [CompletionResultType]::ParameterValue, 'Check whether a motion between two poses is free at every moment, and find when it first touches')
            [CompletionResult]::new('probe', 'probe', [CompletionResultType]::ParameterValue, 'Compute how far points are from a mesh and which of them are inside it, and find what rays and segments hit')
            [CompletionResult]::new('scene', 'scene', [CompletionResultType]::ParameterValue, 'Find which of many placed meshes touch, or how far apart they are')
            [CompletionResult]::new('robot', 'robot', [CompletionResultType]::ParameterValue, 'Check a robot by the values of its joints: whether it touches itself or obstacles, how near it comes, and which motions are free')
            [CompletionResult]::new('clash', 'clash', [CompletionResultType]::ParameterValue, 'Find the parts of an assembly that touch, overlap, contain or come near each other, and how deep or how near')
            [CompletionResult]::new('view', 'view', [CompletionResultType]::ParameterValue, 'Write a page that shows meshes, a motion or a scene in a browser, and runs queries there')
            [CompletionResult]::new('suite', 'suite', [CompletionResultType]::ParameterValue, 'Run the queries of the public suite (spec/suite), one line in and one line out')
            [CompletionResult]::new('report', 'report', [CompletionResultType]::ParameterValue, 'Measure speed against error on your own meshes: for each layout, or for ways to check motions')
            break
        }
        'cbvh;bake' {
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'The file to write; for a folder of meshes, the folder to write to')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'The file to write; for a folder of meshes, the folder to write to')
            [CompletionResult]::new('--manifest', '--manifest', [CompletionResultType]::ParameterName, 'Bake many assets: a file with one JSON object per line, with "input", "output" and options')
            [CompletionResult]::new('--out-manifest', '--out-manifest', [CompletionResultType]::ParameterName, 'With --manifest or a folder: write the result of each asset here, one JSON object per line')
            [CompletionResult]::new('--shard', '--shard', [CompletionResultType]::ParameterName, 'With --manifest or a folder: bake only every N-th asset, starting with the I-th; I is from 1 to N')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--effort', '--effort', [CompletionResultType]::ParameterName, 'Time spent on a better tree: quick or default. Results are the same')
            [CompletionResult]::new('--max-error', '--max-error', [CompletionResultType]::ParameterName, 'With --triangles quantized: how far a vertex may move, in mesh units [default: 1e-5 of the diagonal]')
            [CompletionResult]::new('--weld', '--weld', [CompletionResultType]::ParameterName, 'Weld the vertices of each object: move each to the first vertex within this distance of it, in mesh units')
            [CompletionResult]::new('--max-memory', '--max-memory', [CompletionResultType]::ParameterName, 'Stay within this much memory, such as 512MiB or 2GB; the rest goes to scratch files')
            [CompletionResult]::new('--scratch', '--scratch', [CompletionResultType]::ParameterName, 'With --max-memory: the folder for scratch files [default: the folder of the output]')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads [default: one per core]')
            [CompletionResult]::new('--radius', '--radius', [CompletionResultType]::ParameterName, 'Give the mesh a radius, in mesh units: it stands for all points this near to it, as each point of a cloud does for a ball')
            [CompletionResult]::new('--allow-outside', '--allow-outside', [CompletionResultType]::ParameterName, 'Let glTF files name buffers outside their own folders, which is otherwise refused')
            [CompletionResult]::new('--split-objects', '--split-objects', [CompletionResultType]::ParameterName, 'Build one tree per object of the input, so that queries can name an object')
            [CompletionResult]::new('--scene', '--scene', [CompletionResultType]::ParameterName, 'Bake a scene, with one tree per object: the nodes of glTF and COLLADA files become instances that share their meshes')
            [CompletionResult]::new('--drop-nan', '--drop-nan', [CompletionResultType]::ParameterName, 'Leave out points without a position, those with a coordinate that is nan or infinite, which are otherwise refused')
            [CompletionResult]::new('--solid', '--solid', [CompletionResultType]::ParameterName, 'Make the mesh solid: what is inside touches it. All its objects must be closed')
            [CompletionResult]::new('--no-ids', '--no-ids', [CompletionResultType]::ParameterName, 'Leave out the original triangle numbers')
            [CompletionResult]::new('--no-topology', '--no-topology', [CompletionResultType]::ParameterName, 'Do not store which objects are closed, which queries about the inside of a mesh need')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Bake even if the output is up to date')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object, and one per stage on standard error')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors, warnings, and the object of --json')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors, warnings, and the object of --json')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;dump' {
            [CompletionResult]::new('--treelet', '--treelet', [CompletionResultType]::ParameterName, 'Decode this treelet: the links and slabs of its children')
            [CompletionResult]::new('--page', '--page', [CompletionResultType]::ParameterName, 'Decode this page: its anchors, its links to other pages, its treelets')
            [CompletionResult]::new('--max-memory', '--max-memory', [CompletionResultType]::ParameterName, 'Stay within this much memory, such as 64MiB')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;validate' {
            [CompletionResult]::new('--max-memory', '--max-memory', [CompletionResultType]::ParameterName, 'Stay within this much memory, such as 64MiB')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'How many of these pairs to list, the first ones by object and triangle')
            [CompletionResult]::new('--self-contacts', '--self-contacts', [CompletionResultType]::ParameterName, 'Find all pairs of triangles that meet where they should not; this maps the file')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;verify' {
            [CompletionResult]::new('--max-memory', '--max-memory', [CompletionResultType]::ParameterName, 'Stay within this much memory, such as 64MiB; the rest goes to scratch files')
            [CompletionResult]::new('--scratch', '--scratch', [CompletionResultType]::ParameterName, 'The folder for scratch files [default: the system''s folder for temporary files]')
            [CompletionResult]::new('--allow-outside', '--allow-outside', [CompletionResultType]::ParameterName, 'Let glTF files name buffers outside their own folders, as for bake')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;query' {
            [CompletionResult]::new('--mode', '--mode', [CompletionResultType]::ParameterName, 'The query')
            [CompletionResult]::new('--within', '--within', [CompletionResultType]::ParameterName, 'With --mode within: the distance to compare with, in mesh units')
            [CompletionResult]::new('--rel-err', '--rel-err', [CompletionResultType]::ParameterName, 'With --mode distance: the result may exceed the least distance by this fraction of it')
            [CompletionResult]::new('--abs-err', '--abs-err', [CompletionResultType]::ParameterName, 'With --mode distance: the result may exceed the least distance by this length, in mesh units')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--budget', '--budget', [CompletionResultType]::ParameterName, 'Stop after this many seconds, for each file of queries')
            [CompletionResult]::new('--warm', '--warm', [CompletionResultType]::ParameterName, 'Untimed queries before the timed ones, taken from the end of the file')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Run only the first N queries of each file; 0 runs all')
            [CompletionResult]::new('--object', '--object', [CompletionResultType]::ParameterName, 'Query only the object of this name, in each mesh that has one')
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'Write raw results and times to this file; %s stands for the name of the file of queries')
            [CompletionResult]::new('--read-ahead', '--read-ahead', [CompletionResultType]::ParameterName, 'How the system reads .cbvh files from the disk')
            [CompletionResult]::new('--pose', '--pose', [CompletionResultType]::ParameterName, 'Query one pose, given as 12 numbers, and print the result for a person')
            [CompletionResult]::new('--witness', '--witness', [CompletionResultType]::ParameterName, 'With --mode distance about one pose: write both closest triangles and the segment between them as OBJ')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object per query, with everything that the result has')
            [CompletionResult]::new('--bench', '--bench', [CompletionResultType]::ParameterName, 'Print one JSON object per file, with the times of its queries, and no results')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'cbvh;motion' {
            [CompletionResult]::new('--clearance', '--clearance', [CompletionResultType]::ParameterName, 'Meshes that are at most this far apart count as a hit, in mesh units')
            [CompletionResult]::new('--tolerance', '--tolerance', [CompletionResultType]::ParameterName, 'How far beyond the clearance the result may be near, in mesh units [default: 1e-6 of the smaller diagonal]')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--budget', '--budget', [CompletionResultType]::ParameterName, 'Stop after this many seconds, for each file of queries')
            [CompletionResult]::new('--warm', '--warm', [CompletionResultType]::ParameterName, 'Untimed queries before the timed ones, taken from the end of the file')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Run only the first N queries of each file; 0 runs all')
            [CompletionResult]::new('--object', '--object', [CompletionResultType]::ParameterName, 'Query only the object of this name, in each mesh that has one')
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'Write raw results and times to this file; %s stands for the name of the file of queries')
            [CompletionResult]::new('--read-ahead', '--read-ahead', [CompletionResultType]::ParameterName, 'How the system reads .cbvh files from the disk')
            [CompletionResult]::new('--motion', '--motion', [CompletionResultType]::ParameterName, 'Query one motion, given as 24 numbers, and print the result for a person')
            [CompletionResult]::new('--witness', '--witness', [CompletionResultType]::ParameterName, 'With --motion: write the closest triangles at a hit and the segment between them as OBJ')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object per query, with everything that the result has')
            [CompletionResult]::new('--bench', '--bench', [CompletionResultType]::ParameterName, 'Print one JSON object per file, with the times of its queries, and no results')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'cbvh;probe' {
            [CompletionResult]::new('--mode', '--mode', [CompletionResultType]::ParameterName, 'The query')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--budget', '--budget', [CompletionResultType]::ParameterName, 'Stop after this many seconds, for each file of queries')
            [CompletionResult]::new('--warm', '--warm', [CompletionResultType]::ParameterName, 'Untimed queries before the timed ones, taken from the end of the file')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Run only the first N queries of each file; 0 runs all')
            [CompletionResult]::new('--object', '--object', [CompletionResultType]::ParameterName, 'Query only the object of this name, in each mesh that has one')
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'Write raw results and times to this file; %s stands for the name of the file of queries')
            [CompletionResult]::new('--read-ahead', '--read-ahead', [CompletionResultType]::ParameterName, 'How the system reads .cbvh files from the disk')
            [CompletionResult]::new('--probe', '--probe', [CompletionResultType]::ParameterName, 'Query one point, ray or segment, given as 3 or 6 numbers, and print the result for a person')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object per query, with everything that the result has')
            [CompletionResult]::new('--bench', '--bench', [CompletionResultType]::ParameterName, 'Print one JSON object per file, with the times of its queries, and no results')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'cbvh;scene' {
            [CompletionResult]::new('--mode', '--mode', [CompletionResultType]::ParameterName, 'The query')
            [CompletionResult]::new('--within', '--within', [CompletionResultType]::ParameterName, 'With --mode within: the distance to compare with, in mesh units')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--budget', '--budget', [CompletionResultType]::ParameterName, 'Stop after this many seconds, for each file of queries')
            [CompletionResult]::new('--warm', '--warm', [CompletionResultType]::ParameterName, 'Untimed queries before the timed ones, taken from the end of the file')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Run only the first N queries of each file; 0 runs all')
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'Write raw results and times to this file')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object per query, with everything that the result has')
            [CompletionResult]::new('--list', '--list', [CompletionResultType]::ParameterName, 'Print the pairs of each frame for a person, with their names')
            [CompletionResult]::new('--bench', '--bench', [CompletionResultType]::ParameterName, 'Print one JSON object about all frames, with their times, and no results')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'cbvh;robot' {
            [CompletionResult]::new('--srdf', '--srdf', [CompletionResultType]::ParameterName, 'An SRDF file, whose disabled pairs are not checked')
            [CompletionResult]::new('--package-dir', '--package-dir', [CompletionResultType]::ParameterName, 'A folder that contains packages, for package:// paths of the URDF; may be given several times')
            [CompletionResult]::new('--obstacle', '--obstacle', [CompletionResultType]::ParameterName, 'A mesh that stands in the world, and its pose there; may be given several times')
            [CompletionResult]::new('--mode', '--mode', [CompletionResultType]::ParameterName, 'The query')
            [CompletionResult]::new('--margin', '--margin', [CompletionResultType]::ParameterName, 'With --mode near: bodies that are at most this far apart are near, in metres')
            [CompletionResult]::new('--clearance', '--clearance', [CompletionResultType]::ParameterName, 'With --edges: bodies that are at most this far apart count as a hit, in metres')
            [CompletionResult]::new('--tolerance', '--tolerance', [CompletionResultType]::ParameterName, 'With --edges: how far beyond the clearance the result may be near, in metres [default: 1e-6 of the smaller shape''s diagonal]')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads: they share the queries of a file, or the pairs of each frame of a scene')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--budget', '--budget', [CompletionResultType]::ParameterName, 'Stop after this many seconds, for each file of queries')
            [CompletionResult]::new('--warm', '--warm', [CompletionResultType]::ParameterName, 'Untimed queries before the timed ones, taken from the end of the file')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Run only the first N queries of each file; 0 runs all')
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'Write raw results and times to this file')
            [CompletionResult]::new('--joints', '--joints', [CompletionResultType]::ParameterName, 'Check one configuration (with --edges: one edge), given as a line of FILE, and print the result for a person')
            [CompletionResult]::new('--view', '--view', [CompletionResultType]::ParameterName, 'Write a page that shows the robot, with a slider for each joint value')
            [CompletionResult]::new('--max-page', '--max-page', [CompletionResultType]::ParameterName, 'The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]')
            [CompletionResult]::new('--allow-outside', '--allow-outside', [CompletionResultType]::ParameterName, 'Let the URDF name meshes outside of its package, of the folder above it and of --package-dir')
            [CompletionResult]::new('--solid', '--solid', [CompletionResultType]::ParameterName, 'Obstacles are full: what is inside touches them. Their meshes must be closed')
            [CompletionResult]::new('--edges', '--edges', [CompletionResultType]::ParameterName, 'Check edges: straight motions of all joint values between two configurations')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object per query, with everything that the result has')
            [CompletionResult]::new('--bench', '--bench', [CompletionResultType]::ParameterName, 'Print one JSON object about all lines, with their times, and no results')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'cbvh;clash' {
            [CompletionResult]::new('--manifest', '--manifest', [CompletionResultType]::ParameterName, 'Read the files of parts, their names and poses from this file, one JSON object per line')
            [CompletionResult]::new('--shard', '--shard', [CompletionResultType]::ParameterName, 'Check only the pairs whose earlier part is every N-th one, starting with the I-th; I is from 1 to N')
            [CompletionResult]::new('--clearance', '--clearance', [CompletionResultType]::ParameterName, 'Also find parts that are at most this far apart, in mesh units')
            [CompletionResult]::new('--tolerance', '--tolerance', [CompletionResultType]::ParameterName, 'How far apart or how deep in each other parts may be and count as touching, in mesh units [default: a millionth of the assembly''s diagonal]')
            [CompletionResult]::new('--visits', '--visits', [CompletionResultType]::ParameterName, 'The most visits of the search for the depth of a pair')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates of meshes: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('--sort', '--sort', [CompletionResultType]::ParameterName, 'The order of the list: class, or volume, which also measures')
            [CompletionResult]::new('--min-volume', '--min-volume', [CompletionResultType]::ParameterName, 'Leave out clashes of parts that have less than this volume in common, in cubic mesh units; measures as well')
            [CompletionResult]::new('--baseline', '--baseline', [CompletionResultType]::ParameterName, 'Compare with what --json printed earlier')
            [CompletionResult]::new('--fail-on', '--fail-on', [CompletionResultType]::ParameterName, 'Exit with code 5 if there is a clash of these classes, separated by commas; with --baseline, a new or changed one')
            [CompletionResult]::new('--csv', '--csv', [CompletionResultType]::ParameterName, 'Write the clashes to this file as comma-separated values')
            [CompletionResult]::new('--bcf', '--bcf', [CompletionResultType]::ParameterName, 'Write the clashes to this file as topics of BCF 2.1')
            [CompletionResult]::new('--view', '--view', [CompletionResultType]::ParameterName, 'Write a page that shows the parts and their clashes')
            [CompletionResult]::new('--max-page', '--max-page', [CompletionResultType]::ParameterName, 'The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'The most clashes to list for a person; 0 lists all')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--jobs', '--jobs', [CompletionResultType]::ParameterName, 'The number of threads [default: one per core]')
            [CompletionResult]::new('--magnitudes', '--magnitudes', [CompletionResultType]::ParameterName, 'Also measure what parts have in common: volume, areas, box, and how thick a part is where another one pierces it')
            [CompletionResult]::new('--split-objects', '--split-objects', [CompletionResultType]::ParameterName, 'Make each object of a mesh file a part')
            [CompletionResult]::new('--json', '--json', [CompletionResultType]::ParameterName, 'Print one JSON object with all clashes')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;view' {
            [CompletionResult]::new('--pose', '--pose', [CompletionResultType]::ParameterName, 'Place B in the frame of A by 12 numbers [default: both are in one frame]')
            [CompletionResult]::new('--within', '--within', [CompletionResultType]::ParameterName, 'Also show whether A and B are at most this far apart, in mesh units')
            [CompletionResult]::new('--motion', '--motion', [CompletionResultType]::ParameterName, 'Move B from one pose to another, given as 24 numbers')
            [CompletionResult]::new('--clearance', '--clearance', [CompletionResultType]::ParameterName, 'With --motion: meshes that are at most this far apart count as a hit, in mesh units [default: 0]')
            [CompletionResult]::new('--tolerance', '--tolerance', [CompletionResultType]::ParameterName, 'With --motion: how far beyond the clearance the result may be near [default: 1e-6 of the smaller diagonal]')
            [CompletionResult]::new('--scene', '--scene', [CompletionResultType]::ParameterName, 'Show a scene file, or a .cbvh file made by cbvh bake --scene, and the frames of a file')
            [CompletionResult]::new('--object', '--object', [CompletionResultType]::ParameterName, 'Show only the object of this name, in each mesh that has one')
            [CompletionResult]::new('--profile', '--profile', [CompletionResultType]::ParameterName, 'Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide')
            [CompletionResult]::new('--triangles', '--triangles', [CompletionResultType]::ParameterName, 'Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)')
            [CompletionResult]::new('--round', '--round', [CompletionResultType]::ParameterName, 'Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal')
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'The page to write; without it, the browser opens a page in the temporary folder')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'The page to write; without it, the browser opens a page in the temporary folder')
            [CompletionResult]::new('--max-page', '--max-page', [CompletionResultType]::ParameterName, 'The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;suite' {
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'Instruction set of the queries: auto, scalar, avx2, avx512, neon or simd128')
            [CompletionResult]::new('--effort', '--effort', [CompletionResultType]::ParameterName, 'Time spent on a better tree: quick or default. Results are the same')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'cbvh;report' {
            [CompletionResult]::new('--out', '--out', [CompletionResultType]::ParameterName, 'The folder to write to; it is created if it does not exist')
            [CompletionResult]::new('--meshes', '--meshes', [CompletionResultType]::ParameterName, 'The folder of the meshes [default: that of PAIRS]')
            [CompletionResult]::new('--poses', '--poses', [CompletionResultType]::ParameterName, 'Files of poses for each pair, besides those in PAIRS; %s stands for the pair''s name')
            [CompletionResult]::new('--motions', '--motions', [CompletionResultType]::ParameterName, 'Report on motions instead of layouts. FILEs are files of motions for each pair, besides those in PAIRS; %s stands for the pair''s name')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'The largest number of poses or motions per pair, spread evenly over all; 0 takes all')
            [CompletionResult]::new('--rounds', '--rounds', [CompletionResultType]::ParameterName, 'Rounds in which all layouts, or all ways to check, take turns')
            [CompletionResult]::new('--isa', '--isa', [CompletionResultType]::ParameterName, 'Backend: auto, scalar, avx2, avx512, neon or simd128; auto is the fastest one of this CPU, unless CBVH_ISA names one')
            [CompletionResult]::new('--quick', '--quick', [CompletionResultType]::ParameterName, 'Take only ten poses or motions in two rounds: good for trying the command, too few to quote')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
    })

    $completions.Where{ $_.CompletionText -like "$wordToComplete*" } |
        Sort-Object -Property ListItemText
}
