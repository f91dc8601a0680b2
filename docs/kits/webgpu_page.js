// Draws `kit`: the passes of its table, from first to last, into the canvas.
async function draw() {
  const said = document.getElementById("said");
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter?.features.has("float32-blendable")) {
    said.textContent = "This needs WebGPU with the feature float32-blendable.";
    return;
  }
  const device = await adapter.requestDevice({ requiredFeatures: ["float32-blendable"] });
  const canvas = document.getElementById("picture");
  const context = canvas.getContext("webgpu");
  const shown = navigator.gpu.getPreferredCanvasFormat();
  context.configure({ device, format: shown, alphaMode: "opaque" });
  const module = device.createShaderModule({ code: kit.shaders });

  const data = Uint8Array.from(atob(kit.vertices), (one) => one.charCodeAt(0));
  const vertices = device.createBuffer({
    size: data.length,
    usage: GPUBufferUsage.VERTEX | GPUBufferUsage.COPY_DST,
  });
  device.queue.writeBuffer(vertices, 0, data);
  const columns = [
    { format: "float32x2", offset: 0, shaderLocation: 0 },
    { format: "float32", offset: 8, shaderLocation: 1 },
    { format: "float32", offset: 12, shaderLocation: 2 },
    { format: "float32x3", offset: 16, shaderLocation: 3 },
  ];

  const targets = {};
  for (const one of kit.table.targets) {
    const texture = device.createTexture({
      size: [canvas.width, canvas.height],
      format: one.format.webgpu,
      usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING,
    });
    targets[one.name] = { ...one, format: one.format.webgpu, view: texture.createView() };
  }
  const blended = (format, { operation, source, destination }) => {
    const component = { operation, srcFactor: source, dstFactor: destination };
    return { format, blend: { color: component, alpha: component } };
  };

  const encoder = device.createCommandEncoder();
  for (const pass of kit.table.passes) {
    const resolves = pass.name === "resolve";
    const drawn = resolves ? [] : pass.targets.map((name) => targets[name]);
    const pipeline = device.createRenderPipeline({
      layout: "auto",
      vertex: {
        module,
        entryPoint: resolves ? "whole" : "pane",
        buffers: resolves ? [] : [{ arrayStride: 28, attributes: columns }],
      },
      fragment: {
        module,
        entryPoint: pass.name,
        targets: resolves
          ? [blended(shown, pass.blend)]
          : drawn.map((one) => blended(one.format, one.blend)),
      },
    });
    const attachments = resolves
      ? [{ view: context.getCurrentTexture().createView(), clearValue: kit.background }]
      : drawn.map((one) => ({ view: one.view, clearValue: Array(4).fill(one.clear) }));
    const render = encoder.beginRenderPass({
      colorAttachments: attachments.map((one) => ({ ...one, loadOp: "clear", storeOp: "store" })),
    });
    render.setPipeline(pipeline);
    if (pass.reads.length) {
      const entries = pass.reads.map((name) => ({
        binding: kit.table.bindings[name],
        resource: targets[name].view,
      }));
      const layout = pipeline.getBindGroupLayout(0);
      render.setBindGroup(0, device.createBindGroup({ layout, entries }));
    }
    if (!resolves) render.setVertexBuffer(0, vertices);
    render.draw(resolves ? 3 : kit.count);
    render.end();
  }
  device.queue.submit([encoder.finish()]);
  await device.queue.onSubmittedWorkDone();
  said.textContent = `${kit.table.technique}, ${kit.table.bytes_a_pixel} bytes a pixel`;
}

draw();
