import { beforeAll, describe, expect, it, vi } from "vitest";

describe("addresses", () => {
  let router: typeof import("./router");
  beforeAll(async () => {
    vi.stubGlobal("location", { hash: "" });
    vi.stubGlobal("window", { addEventListener: () => {} });
    router = await import("./router");
  });

  it("are read as they are written", () => {
    const link = router.linkTo(["search", "my shapes"], { label: "a&b=c", shape: "7" });
    const { path, query } = router.parse(link);
    expect(path).toEqual(["search", "my shapes"]);
    expect(Object.fromEntries(query)).toEqual({ label: "a&b=c", shape: "7" });
  });

  it("leave out what is not given", () => {
    expect(router.linkTo(["jobs"], { state: null, kind: "", model: undefined })).toBe("#/jobs");
  });

  it("may be broken without harm", () => {
    expect(router.parse("#/shapes/%E0%A4%A").path).toEqual(["shapes", "%E0%A4%A"]);
    expect(router.parse("").path).toEqual([]);
  });
});
