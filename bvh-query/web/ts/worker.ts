/** The program of the worker that `CbvhWorker.start` starts. */

import { serve } from "./serve.js";

serve(globalThis as unknown as Worker);
