/** Asks the worker. Questions are answered one after the other, in their order. */

import type { Handlers, Question, Reply } from "../worker/worker.js";

type Parts<Name extends keyof Handlers> = Parameters<Handlers[Name]>;
type Answer<Name extends keyof Handlers> = Awaited<ReturnType<Handlers[Name]>>;

interface Waiting {
    resolve: (answer: unknown) => void;
    reject: (error: Error) => void;
    onStage: ((stage: string) => void) | undefined;
}

export class Asker {
    readonly #worker: Worker;
    readonly #waiting = new Map<number, Waiting>();
    #next = 0;

    /** Starts a worker with this code. It is a blob, because a page from a file may load no other files. */
    constructor(code: ArrayBuffer) {
        const address = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
        this.#worker = new Worker(address);
        this.#worker.onmessage = ({ data }: MessageEvent<Reply>) => this.#take(data);
        this.#worker.onerror = (event) => {
            event.preventDefault();
            this.#fail(new Error(event.message || "the worker of this page cannot start"));
        };
    }

    /** Asks a question. `onStage` is called with the stages of a bake. */
    ask<Name extends keyof Handlers>(name: Name, ...parts: Parts<Name>): Promise<Answer<Name>> {
        return this.askInStages(undefined, name, ...parts);
    }

    askInStages<Name extends keyof Handlers>(
        onStage: ((stage: string) => void) | undefined,
        name: Name,
        ...parts: Parts<Name>
    ): Promise<Answer<Name>> {
        return new Promise((resolve, reject) => {
            const number = this.#next++;
            this.#waiting.set(number, { resolve: (answer) => resolve(answer as Answer<Name>), reject, onStage });
            const question: Question = { number, name, parts };
            const moved = parts.filter((part): part is ArrayBuffer => part instanceof ArrayBuffer);
            this.#worker.postMessage(question, moved);
        });
    }

    #take(reply: Reply): void {
        const waiting = this.#waiting.get(reply.number);
        if (waiting === undefined) {
            return;
        }
        if ("stage" in reply) {
            waiting.onStage?.(reply.stage);
            return;
        }
        this.#waiting.delete(reply.number);
        if ("error" in reply) {
            waiting.reject(new Error(reply.error));
        } else {
            waiting.resolve(reply.answer);
        }
    }

    #fail(error: Error): void {
        for (const waiting of this.#waiting.values()) {
            waiting.reject(error);
        }
        this.#waiting.clear();
    }
}

/** Runs one piece of work at a time, and of those that come meanwhile only the last. */
export class Latest {
    #isRunning = false;
    #next: { work: () => Promise<void>; done: () => void } | undefined;

    /** The promise is done when the work is, or when later work has taken its place. */
    run(work: () => Promise<void>): Promise<void> {
        this.#next?.done();
        return new Promise((done) => {
            this.#next = { work, done };
            if (!this.#isRunning) {
                void this.#drain();
            }
        });
    }

    async #drain(): Promise<void> {
        this.#isRunning = true;
        while (this.#next !== undefined) {
            const { work, done } = this.#next;
            this.#next = undefined;
            await work();
            done();
        }
        this.#isRunning = false;
    }
}
