// node validate-gltf.mjs FILE.glb: prints the Khronos validator's report; status 0 without errors and warnings.
import { readFile } from 'node:fs/promises';
import process from 'node:process';
import validator from 'gltf-validator';

const path = process.argv[2];
if (!path) {
  console.error('usage: node validate-gltf.mjs FILE.glb');
  process.exit(2);
}
const report = await validator.validateBytes(new Uint8Array(await readFile(path)), {
  uri: path,
  maxIssues: 100,
  externalResourceFunction: () => Promise.reject(new Error('a .glb must not refer to other files')),
});
const { numErrors, numWarnings, numInfos, numHints } = report.issues;
console.log(JSON.stringify({ numErrors, numWarnings, numInfos, numHints, info: report.info }, null, 2));
for (const { code, message, severity, pointer } of report.issues.messages) {
  console.log(`${['error', 'warning', 'info', 'hint'][severity]} ${code} ${pointer ?? ''}: ${message}`);
}
process.exit(numErrors + numWarnings > 0 ? 1 : 0);
