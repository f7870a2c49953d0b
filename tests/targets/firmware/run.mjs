// Runs the firmware's WebAssembly; its exit code is ours.
import { readFileSync } from 'node:fs';

const put_bytes = (start, len) => process.stdout.write(Buffer.from(memory.buffer, start, len));
const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), { dynvox: { put_bytes } });
const memory = instance.exports.memory;
process.exitCode = instance.exports.run();
