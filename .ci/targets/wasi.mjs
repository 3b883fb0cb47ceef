// Runs a WebAssembly program with the arguments, the variables and the files of this machine: node wasi.mjs PROGRAM ARGUMENT...
import { readFile } from "node:fs/promises";
import { WASI } from "node:wasi";

const args = process.argv.slice(2);
const wasi = new WASI({ version: "preview1", args, env: process.env, preopens: { "/": "/" }, returnOnExit: true });
const module = await WebAssembly.compile(await readFile(args[0]));
// A program that panics ends with a trap, which node throws as an error.
process.exit(wasi.start(await WebAssembly.instantiate(module, wasi.getImportObject())));
