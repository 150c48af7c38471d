(function(){"use strict";const ut=`
#define ROW 44
#define EDGE 1e-6
layout(std140) uniform Edits { vec4 rows[1024]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and how far off that is.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at, p - rows[at + 3].xyz);
  vec3 xi = y;
  error = 0.0;
  if (rows[at].w < 0.5) {
    if (inBox(y, rows[at + 4].xyz, rows[at + 5].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + 6, xi, bent(at + 6, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + 6, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at, v);
  int c = at + 10;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
  if (rows[at].w < 0.5) {
    along = bendSolve(at + 6, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & 2047, n >> ${Math.log2(2048)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + 3, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + 6].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Takes a sample through the edit whose numbers begin at a row. Where it is to be read then: 0 in the field, or by
// the place of a layer, how many vertices further along x; -1 nowhere.
int mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + 3].w > 0.5;
  int resolution_ = int(rows[e + 2].w);
  int first = e + 8;
  if (rows[e + 4].w > 0.5) {
    vec3 y = times(first, p - rows[first + 3].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return 0;
    }
    vec3 at = times(e + 3, p - rows[e + 2].xyz);
    if (inBox(at, rows[e + 6].xyz, rows[e + 7].xyz)) interpolate(e, resolution_, at, p, v);
    return 0;
  }
  float error;
  if (rows[e].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return int(rows[e + 7].w);
    }
  }
  if (rows[e + 1].w < 1.5) return 0;
  hexahedron(p, first + 18, error);
  if (!continuous) return error <= EDGE ? int(rows[e + 5].w) : 0;
  if (error <= EDGE) interpolate(e, resolution_, times(e + 3, p - rows[e + 2].xyz), p, v);
  return 0;
}

MAP_SAMPLE
// The part of a ray outside which no edit changes anything.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * ROW + 2 * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`,dt=2;function ft(s){return s<=dt?s:null}function mt(s){const e=n=>`if (place == 0 && inBox(p, rows[${n}].xyz, rows[${n} + 1].xyz)) place = mapEdit(${n}, p, v);`,r=["int mapSample(inout vec3 p, inout vec3 v) {","  int place = 0;",...(s===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * ROW")} }`]:Array.from({length:s},(n,i)=>e(`${s-1-i} * ROW`))).map(n=>`  ${n}`),"  return place;","}"];return ut.replace("MAP_SAMPLE",`${r.join(`
`)}
`)}function O(s,e,t){const r=performance.now(),n=s.createProgram();for(const[a,c]of[[s.VERTEX_SHADER,e],[s.FRAGMENT_SHADER,t]]){const l=s.createShader(a);if(l===null)throw new Error("the GPU's context is lost");s.shaderSource(l,c),s.compileShader(l),s.attachShader(n,l),s.deleteShader(l)}if(s.linkProgram(n),!s.getProgramParameter(n,s.LINK_STATUS)&&!s.isContextLost()){const c=(s.getAttachedShaders(n)??[]).map(l=>s.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${s.getProgramInfoLog(n)??""}`)}const i=new Map;return{program:n,uniform:a=>{const c=i.get(a);if(c!==void 0)return c;const l=s.getUniformLocation(n,a);return i.set(a,l),l},milliseconds:performance.now()-r}}class ye extends Error{constructor(){super("the GPU has not enough memory for the field")}}function H(s){for(let e=s.getError();e!==s.NO_ERROR&&e!==s.CONTEXT_LOST_WEBGL;e=s.getError())if(e===s.OUT_OF_MEMORY)throw new ye}function D(s,e,t,r){const n=s.createTexture();s.bindTexture(s.TEXTURE_3D,n),s.texStorage3D(s.TEXTURE_3D,1,e,t[0],t[1],t[2]),V(s,s.TEXTURE_3D,r);try{H(s)}catch(i){throw s.deleteTexture(n),i}return n}function V(s,e,t){s.texParameteri(e,s.TEXTURE_MIN_FILTER,t),s.texParameteri(e,s.TEXTURE_MAG_FILTER,t);for(const r of e===s.TEXTURE_3D?[s.TEXTURE_WRAP_S,s.TEXTURE_WRAP_T,s.TEXTURE_WRAP_R]:[s.TEXTURE_WRAP_S,s.TEXTURE_WRAP_T])s.texParameteri(e,r,s.CLAMP_TO_EDGE)}function R(s){s.bindBuffer(s.PIXEL_UNPACK_BUFFER,null),s.pixelStorei(s.UNPACK_ALIGNMENT,1),s.pixelStorei(s.UNPACK_FLIP_Y_WEBGL,!1),s.pixelStorei(s.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),s.pixelStorei(s.UNPACK_COLORSPACE_CONVERSION_WEBGL,s.NONE);for(const e of[s.UNPACK_ROW_LENGTH,s.UNPACK_IMAGE_HEIGHT,s.UNPACK_SKIP_PIXELS,s.UNPACK_SKIP_ROWS,s.UNPACK_SKIP_IMAGES])s.pixelStorei(e,0)}function J(s,e){return s.getParameter(e)??16384}class pt{constructor(e){this.gl=e}uploaded={last:0,total:0};current=null;buffer=null;lattices=null;occupancy=null;get edits(){return this.current}get bricks(){return this.occupancy?.texture??null}count(e){this.uploaded.last+=e,this.uploaded.total+=e}set(e){if(this.uploaded.last=0,e===null||e.edits===0){this.dispose();return}if(e.rows.length>4*1024)throw new Error("more edits than the page's shader holds");this.putRows(e),this.putLattices(e),this.putOccupancy(e),this.current=e,this.uploaded.total+=this.uploaded.last}bind(e){const{gl:t}=this;return t.uniformBlockBinding(e,t.getUniformBlockIndex(e,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,this.buffer),this.lattices?.texture??null}forget(){this.current=this.buffer=this.lattices=this.occupancy=null}dispose(){const{gl:e}=this;e.deleteBuffer(this.buffer),e.deleteTexture(this.lattices?.texture??null),e.deleteTexture(this.occupancy?.texture??null),this.forget()}putRows({rows:e}){const{gl:t}=this,r=this.buffer===null;this.buffer??=t.createBuffer(),t.bindBuffer(t.UNIFORM_BUFFER,this.buffer),r&&t.bufferData(t.UNIFORM_BUFFER,16*1024,t.DYNAMIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e),t.bindBuffer(t.UNIFORM_BUFFER,null),this.uploaded.last+=e.byteLength}putLattices({lattices:e}){const{gl:t}=this,r=e.map(({halves:c})=>Math.ceil(c.length/(3*2048))),n=Math.max(1,r.reduce((c,l)=>c+l,0));if(n>J(t,t.MAX_TEXTURE_SIZE))throw new Error("the edits' lattices do not fit into a texture of the GPU");(this.lattices===null||n>this.lattices.rows)&&(t.deleteTexture(this.lattices?.texture??null),this.lattices={texture:this.latticeTexture(n),rows:n,placed:[]});const{texture:i,placed:o}=this.lattices;R(t),t.bindTexture(t.TEXTURE_2D,i);let a=0;this.lattices.placed=e.map(({key:c,halves:l},h)=>{const u={key:c,row:a};if(o.every(d=>d.key!==c||d.row!==u.row)){const d=6144*r[h],f=l.length===d?l:new Uint16Array(d);f!==l&&f.set(l),t.texSubImage2D(t.TEXTURE_2D,0,0,a,2048,r[h],t.RGB,t.HALF_FLOAT,f),this.uploaded.last+=f.byteLength}return a+=r[h],u}),t.bindTexture(t.TEXTURE_2D,null),H(t)}latticeTexture(e){const{gl:t}=this,r=t.createTexture();return t.bindTexture(t.TEXTURE_2D,r),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,2048,e),V(t,t.TEXTURE_2D,t.NEAREST),r}putOccupancy({occupancy:{key:e,dims:t,codes:r,changed:n}}){const{gl:i,occupancy:o}=this;if(o?.key===e)return;R(i);const a=o!==null&&o.dims.every((f,m)=>f===t[m]);a||i.deleteTexture(o?.texture??null);const c=a?o.texture:D(i,i.R16UI,[t[2],t[1],t[0]],i.NEAREST),l=a&&n?.of===o.key?n:{low:[0,0,0],dims:t,codes:r};i.bindTexture(i.TEXTURE_3D,c);const[h,u,d]=l.low;i.texSubImage3D(i.TEXTURE_3D,0,d,u,h,l.dims[2],l.dims[1],l.dims[0],i.RED_INTEGER,i.UNSIGNED_SHORT,l.codes),i.bindTexture(i.TEXTURE_3D,null),this.occupancy={texture:c,key:e,dims:t},this.uploaded.last+=l.codes.byteLength}}class F{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}held=[];length=0;arrived=0;source;async take(e){for(;this.length<e;){const{value:n,done:i}=await this.source.read();if(i)throw new Error("the file of the field is truncated");this.held.push(n),this.length+=n.length,this.arrived+=n.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let r=0;for(;r<e;){const n=this.held[0],i=n.subarray(0,e-r);t.set(i,r),r+=i.length,i.length===n.length?this.held.shift():this.held[0]=n.subarray(i.length)}return this.length-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function xt(s){const e=new Blob([s]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class A{constructor(e,t,r){this.header=e,this.entries=t,this.reader=r}next=0;static async open(e,t,r){const n=await e.take(16),i=new DataView(n.buffer);if(String.fromCharCode(...n.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const o=i.getUint32(8,!0);if(o!==r)throw new Error(`"${t}" of version ${o}, this page reads ${r}; reload it`);const a=new TextDecoder().decode(await e.take(i.getUint32(12,!0))),c=JSON.parse(a);return new A(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const r=await xt(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(r);case"u2":return new Uint16Array(r);case"i4":return new Int32Array(r);case"f4":return new Float32Array(r)}}}const yt="cagepage",wt=1;async function*gt(s,e){const t=new F(s,e);try{const r=await A.open(t,yt,wt);for(const[n,i]of r.header.levels.entries()){const o=await r.read(`${n}.bricks`),a=await r.read(`${n}.masks`),c=await r.read(`${n}.occupancy`),l=await we(r,`${n}`);yield{field:r.header,header:i,last:n===r.header.levels.length-1,bricks:o,masks:a,...l,occupancy:{origin:[0,0,0],dims:i.dims,codes:c}}}}finally{t.cancel()}}async function we(s,e){const t=Q(await s.read(`${e}.density`));return{density:t,sh:vt(await s.read(`${e}.sh`),t.length)}}function Q(s){const e=s.length/2,t=new Uint16Array(e);for(let r=0;r<e;r++)t[r]=s[r]|s[e+r]<<8;return t}function vt(s,e){if(e===0)return s;for(let t=0;t<s.length;t+=e){let r=128;for(let n=t;n<t+e;n++)s[n]=r=r+s[n]&255}return s}const ee=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)","2.890611442640554 * d.x * d.y * d.z","-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)","-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","1.445305721320277 * d.z * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y)","2.5033429417967046 * d.x * d.y * (d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.y * d.z * (3.0 * d.x * d.x - d.y * d.y)","0.9461746957575601 * d.x * d.y * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-0.6690465435572892 * d.y * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.10578554691520431 * (8.0 * d.z * d.z * d.z * d.z - 24.0 * d.z * d.z * (d.x * d.x + d.y * d.y) + 3.0 * (d.x * d.x + d.y * d.y) * (d.x * d.x + d.y * d.y))","-0.6690465435572892 * d.x * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.47308734787878004 * (d.x * d.x - d.y * d.y) * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.x * d.z * (d.x * d.x - 3.0 * d.y * d.y)","0.6258357354491761 * (d.x * d.x * (d.x * d.x - 3.0 * d.y * d.y) - d.y * d.y * (3.0 * d.x * d.x - d.y * d.y))"];function Et(s){const e=Math.ceil(3*s/4),t=[`uniform float coefficientSteps[${s}];`,...Array.from({length:e},(r,n)=>`uniform sampler3D colourAtlas${n};`),"vec3 colourAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(r,n)=>`  vec4 s${n} = 255.0 * textureLod(colourAtlas${n}, at, 0.0) - 128.0;`)];for(let r=0;r<s;r++){const n=[0,1,2].map(i=>`s${3*r+i>>2}.${"xyzw"[3*r+i&3]}`);t.push(`  rgb += (coefficientSteps[${r}] * (${ee[r]})) * vec3(${n.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colours:e}}const Tt=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
uniform bool layered;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// The texel, whole where a vertex is, of grid coordinates in the atlas, of the field or of the layer at a place; false
// where their brick is empty.
bool locate(vec3 g, int place, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 entry = texelFetch(brickIndex, ivec3(b.zy, b.x + place / BRICK), 0);
  corner = ivec3(entry.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return entry.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,bt=`
// Rounded here, and put amid the step: some GPUs cut off where others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    int place = 0;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      place = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (place < 0) alive = false;
      else if (!layered) place = 0;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, place, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colourAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLOURS;
#endif
          rgb += w * clamp(c, 0.0, 1.0);
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColour = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function Rt(s,e){const{source:t,colours:r}=Et(s.K),n=[`#define BRICK ${e}`,`#define COLOURS ${r}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return s.contracted&&n.push("#define CONTRACTED"),s.edited&&n.push("#define EDITED"),s.normals&&n.push("#define NORMALS"),s.count&&n.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...n,Tt,t,s.edited?mt(s.edits):"",bt].join(`
`)}function At(s,e,t,r,n,i){const{bounds:o,contracted:a}=t.field,{resolution:c,unit:l,steps:h}=t.header,{across:u,edge:d,dims:f}=r,p=o[1].map((w,g)=>w-o[0][g]).map((w,g)=>a?2/w:(c[g]-1)/w),x=o[0].map((w,g)=>a?.5*(w+o[1][g]):w);s.uniform3f(e("atlasScale"),1/(u[0]*d),1/(u[1]*d),1/(u[2]*d)),s.uniform3i(e("indexDims"),...f),s.uniform3i(e("bricksOrigin"),...n.origin),s.uniform3i(e("bricksDims"),...n.dims),s.uniform3i(e("resolution"),...c),s.uniform3fv(e("lower"),x),s.uniform3fv(e("scale"),p),s.uniform3fv(e("halfGrid"),c.map(w=>(w-1)/4)),s.uniform1f(e("unit"),l),s.uniform1f(e("marchStep"),a?i:i/Math.max(...p)),s.uniform1fv(e("coefficientSteps"),h)}function _t(s,e,t,{width:r,height:n}){const{c2w:i}=t,o=r/t.width,a=n/t.height;s.uniform3f(e("eye"),i[3],i[7],i[11]),s.uniformMatrix3fv(e("rotation"),!0,[i[0],i[1],i[2],i[4],i[5],i[6],i[8],i[9],i[10]]),s.uniform4f(e("lens"),t.fx*o,t.fy*a,t.cx*o,t.cy*a),s.uniform1f(e("height"),n)}function ge([s,e],t){const r=.5*Math.hypot(...e.map((i,o)=>i-s[o])),n=Math.hypot(...e.map((i,o)=>.5*(i+s[o])-t.c2w[4*o+3]));return[Math.max(0,n-r),n+r]}const C=`#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;function z(s){for(const e of[s.BLEND,s.DEPTH_TEST,s.CULL_FACE,s.STENCIL_TEST,s.SCISSOR_TEST,s.DITHER])s.disable(e);s.colorMask(!0,!0,!0,!0),s.depthMask(!1)}function k(s){for(let e=15;e>=0;e--)s.activeTexture(s.TEXTURE0+e),s.bindTexture(s.TEXTURE_2D,null),s.bindTexture(s.TEXTURE_3D,null);s.bindVertexArray(null),s.bindFramebuffer(s.FRAMEBUFFER,null),s.useProgram(null)}class P{constructor(e,t,r,n){this.vertices=e,this.brick=t,this.low=r,this.dims=n;const i=t**3,{bricks:o,masks:a}=e;this.numbers=new Int32Array(o.length).fill(-1),this.slots=new Int32Array(a.length/(i/8)*i).fill(-1);let c=0;o.forEach((h,u)=>{h&&(this.numbers[u]=c++)});let l=0;for(let h=0;h<this.slots.length;h++)a[h>>3]>>(h&7)&1&&(this.slots[h]=l++)}slots;numbers;static ofLevel(e){const{brick:t}=e.field;return new P(e,t,[0,0,0],e.header.resolution.map(r=>Math.ceil(r/t)))}slot(e,t,r){const{brick:n,low:i,dims:o}=this,a=Math.floor(e/n)-i[0],c=Math.floor(t/n)-i[1],l=Math.floor(r/n)-i[2];if(a<0||c<0||l<0||a>=o[0]||c>=o[1]||l>=o[2])return-1;const h=this.numbers[(a*o[1]+c)*o[2]+l];return h<0?-1:this.slots[((h*n+e%n)*n+t%n)*n+r%n]}}class N extends Error{}function te(s,e,t=0){const r=s.field.brick,n=r+1,i=s.header.resolution.map(p=>Math.ceil((p-1)/r)),o=Ut(s,i),a=Math.min(255,Math.floor(e/n)),c=o.length+t,l=Math.min(a,Math.max(1,Math.ceil(Math.cbrt(c)))),h=Math.min(a,Math.max(1,Math.ceil(Math.sqrt(c/l)))),u=Math.max(1,Math.ceil(c/(l*h)));if(u>a)throw new N(`${c} bricks do not fit into textures of ${e} texels an edge`);const d=new Uint8Array(4*i[0]*i[1]*i[2]),f=[l,h,u];for(const[p,x]of o.entries())d.set(re(p,f),4*x);const m=Math.ceil(3*s.header.steps.length/4);return{brick:r,edge:n,dims:i,across:f,count:o.length,index:d,bricks:o,colours:m}}function re(s,[e,t]){return[s%e,Math.floor(s/e)%t,Math.floor(s/(e*t)),255]}function se({across:s,edge:e,colours:t,index:r}){return s[0]*s[1]*s[2]*e**3*(2+4*t)+r.length}function Ut(s,e){const{codes:t,dims:r}=s.occupancy,n=s.field.brick/4,i=new Uint8Array(e[0]*e[1]*e[2]);let o=0;for(let a=0;a<r[0];a++)for(let c=0;c<r[1];c++)for(let l=0;l<r[2];l++,o++)t[o]<256&&(i[(Math.floor(a/n)*e[1]+Math.floor(c/n))*e[2]+Math.floor(l/n)]=1);return Int32Array.from(i.keys()).filter(a=>i[a]===1)}class ve{constructor(e,t){this.layout=e,this.sources=t}texels(e,t,r){const{edge:n,colours:i,brick:o,dims:a}=this.layout,c=t*r*n**3,l={density:new Uint16Array(c),colours:Array.from({length:i},()=>new Uint8Array(4*c).fill(128))},h=t*n,u=h*r*n;for(let d=0;d<e.length;d++){const f=e[d],m=[Math.floor(f/(a[1]*a[2])),Math.floor(f/a[2])%a[1],f%a[2]],p=d%t*n+Math.floor(d/t)*n*h;for(let x=0;x<n;x++)for(let w=0;w<n;w++)for(let g=0;g<n;g++)this.put(l,p+x*u+w*h+g,m[0]*o+x,m[1]*o+w,m[2]*o+g)}return l}put(e,t,r,n,i){for(const o of this.sources){const a=o.slot(r,n,i);if(a<0)continue;const{density:c,sh:l}=o.vertices,h=l.length/c.length;e.density[t]=c[a];for(let u=0;u<h;u++)e.colours[u>>2][4*t+(u&3)]=l[u*c.length+a];return}}}const Mt=1/4,St=64;function Ot(s,e,t,r){const n=J(s,s.MAX_3D_TEXTURE_SIZE),i=r(te(e,n)),o=te(e,n,i),a=se(o);if(a>t)throw new N(`the field takes ${Math.ceil(a/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);if(!e.last)return o;try{const c=te(e,n,i+Math.max(St,Math.ceil(Mt*(o.count+i))));return se(c)>t?o:c}catch(c){if(c instanceof N)return o;throw c}}async function Dt(s,e,t,r){const n=Ee(s,e,t);try{for(let i=n.next();;i=r()?n.next():n.throw(new Error("not wanted any more"))){if(i.done)return i.value;await new Promise(o=>setTimeout(o))}}catch(i){if(!r())return null;throw i}}function Ft(s,e,t){const r=Ee(s,e,t);for(;;){const n=r.next();if(n.done)return n.value}}function*Ee(s,e,t){const{across:r,edge:n,dims:i}=t,o=r.map(l=>l*n),a=[];let c=!1;try{const l=D(s,s.R16F,o,s.LINEAR);a.push(l);const h=Array.from({length:t.colours},()=>{const m=D(s,s.RGBA8,o,s.LINEAR);return a.push(m),m}),u=new ve(t,[P.ofLevel(e)]),d=r[0]*r[1];for(let m=0;m<r[2];m++){R(s);const p=t.bricks.subarray(m*d,(m+1)*d);Te(s,{layout:t,density:l,colours:h},u.texels(p,r[0],r[1]),[0,0,m],[r[0],r[1]]),yield}R(s);const f=D(s,s.RGBA8UI,[i[2],i[1],i[0]],s.NEAREST);return a.push(f),s.texSubImage3D(s.TEXTURE_3D,0,0,0,0,i[2],i[1],i[0],s.RGBA_INTEGER,s.UNSIGNED_BYTE,t.index),s.bindTexture(s.TEXTURE_3D,null),H(s),c=!0,{layout:t,density:l,colours:h,index:f,slices:i[0],bytes:se(t)}}finally{if(!c)for(const l of a)s.deleteTexture(l)}}function Te(s,{layout:{edge:e},density:t,colours:r},n,i,o){const a=(c,l,h,u)=>{s.bindTexture(s.TEXTURE_3D,c);const[d,f,m]=i.map(p=>p*e);s.texSubImage3D(s.TEXTURE_3D,0,d,f,m,o[0]*e,o[1]*e,e,l,h,u)};a(t,s.RED,s.HALF_FLOAT,n.density),n.colours.forEach((c,l)=>a(r[l],s.RGBA,s.UNSIGNED_BYTE,c)),s.bindTexture(s.TEXTURE_3D,null)}function be(s,{dims:e,codes:t}){R(s);const r=D(s,s.R16UI,[e[2],e[1],e[0]],s.NEAREST);return s.texSubImage3D(s.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],s.RED_INTEGER,s.UNSIGNED_SHORT,t),s.bindTexture(s.TEXTURE_3D,null),r}function Re(s,e){for(const t of[e.density,e.index,...e.colours])s.deleteTexture(t)}const Ae=1,zt=2;async function _e(s,e,t){const r=[...await s.read(`${e}.box`)],n=await s.read(`${e}.cells`),i=await s.read(`${e}.bricks`),o=await s.read(`${e}.masks`);return{key:t,low:r.slice(0,3),dims:r.slice(3),cells:n,bricks:i,masks:o,...await we(s,e)}}function Ue(s,{dims:e}){return Int32Array.from(ne(s,e,Ae))}function kt(s,e,t){const{dims:r,across:n}=s,i=4*r[1]*r[2],o=Math.max(r[0],...e.map(c=>c.place+c.end)),a=new Uint8Array(o*i);a.set(s.index);for(const{layer:c,place:l,...h}of e){const u=l*i,[d,f]=[Math.max(0,h.first),Math.min(h.end,r[0])].map(x=>x*i);a.set(s.index.subarray(d,f),u+d);const m=t(c);let p=0;for(const x of ne(c,r,Ae))a.set(re(m[p++],n),u+4*x);for(const x of ne(c,r,zt))a.fill(0,u+4*x,u+4*x+4)}return{dims:[o,r[1],r[2]],index:a}}function*ne({low:s,dims:e,cells:t},r,n){let i=0;for(let o=s[0];o<s[0]+e[0];o++)for(let a=s[1];a<s[1]+e[1];a++)for(let c=s[2];c<s[2]+e[2];c++,i++)t[i]===n&&(yield(o*r[1]+a)*r[2]+c)}class Nt{free;taken=new Map;constructor(e,t){this.free=Array.from({length:Math.max(0,t-e)},(r,n)=>t-1-n)}get left(){return this.free.length}of(e){return this.taken.get(e)??null}keep(e){for(const[t,r]of this.taken)e.has(t)||(this.free.push(...Array.from(r).reverse()),this.taken.delete(t))}take(e,t){if(t>this.free.length)return null;const r=Int32Array.from({length:t},()=>this.free.pop()??-1);return this.taken.set(e,r),r}}function It(s,e){return[...new Map(s.map(({layer:r})=>[r.key,r])).values()].reduce((r,n)=>r+Ue(n,e).length,0)}class Me{constructor(e,t,r){this.gl=e,this.textures=t,this.level=r;const{across:n,count:i}=t.layout;this.places=new Nt(i,n[0]*n[1]*n[2])}places;field=null;shown="[]";set(e){const t=JSON.stringify(e.map(({layer:n,place:i,first:o,end:a})=>[n.key,i,o,a]));if(t===this.shown)return 0;this.places.keep(new Set(e.map(({layer:n})=>n.key)));let r=0;for(const{layer:n}of e){if(this.places.of(n.key))continue;const i=Ue(n,this.textures.layout),o=this.places.take(n.key,i.length);if(o===null)return this.shown="",null;r+=this.upload(n,i,o)}return r+=this.putIndex(e),this.shown=t,H(this.gl),r}upload(e,t,r){const{gl:n,textures:i,level:o}=this,{layout:a}=i;this.field??=P.ofLevel(o);const c=new ve(a,[new P(e,a.brick,e.low,e.dims),this.field]);return R(n),t.forEach((l,h)=>{const[u,d,f]=re(r[h],a.across);Te(n,i,c.texels([l],1,1),[u,d,f],[1,1])}),t.length*a.edge**3*(2+4*a.colours)}putIndex(e){const{gl:t,textures:r}=this,{dims:n,index:i}=kt(r.layout,e,o=>this.places.of(o.key)??[]);return R(t),n[0]!==r.slices&&(t.deleteTexture(r.index),r.index=D(t,t.RGBA8UI,[n[2],n[1],n[0]],t.NEAREST),r.slices=n[0]),t.bindTexture(t.TEXTURE_3D,r.index),t.texSubImage3D(t.TEXTURE_3D,0,0,0,0,n[2],n[1],n[0],t.RGBA_INTEGER,t.UNSIGNED_BYTE,i),t.bindTexture(t.TEXTURE_3D,null),i.length}}class ie{constructor(e,t,r,n){this.gl=e,this.memory=t,this.level=r,this.textures=n,this.layers=r.last?new Me(e,n,r):null,this.occupancy=be(e,r.occupancy)}occupancy;layers;solid=null;static async upload(e,t,r,n,i){const o=await Dt(e,r,Se(e,t,r,n),i);return o&&new ie(e,t,r,o)}get layered(){return this.layers!==null}putLayers(e){if(this.layers===null)return 0;const t=this.layers.set(e);if(t!==null)return t;const{gl:r,level:n}=this,i=Se(r,this.memory,n,e);return Re(r,this.textures),this.textures=Ft(r,n,i),this.layers=new Me(r,this.textures,n),this.layers.set(e)??0}get withoutLeaps(){const{occupancy:e}=this.level;return this.solid??=be(this.gl,{...e,codes:new Uint16Array(e.codes.length).fill(255)}),this.solid}dispose(){Re(this.gl,this.textures),this.gl.deleteTexture(this.occupancy),this.gl.deleteTexture(this.solid)}}function Se(s,e,t,r){return Ot(s,t,e,n=>t.last?It(r,n):0)}class Oe{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get colour(){return this.textures?.colour??null}get normals(){return this.textures?.normals??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={colour:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{colour:r,depth:n,normals:i}=this.textures;for(const[o,a]of[r,n,i].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+o,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:r,height:n}=this,i=new Uint8Array(4*r*n),o=e&&this.textures?.normals?new Uint8Array(4*r*n):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,r,n,t.RGBA,t.UNSIGNED_BYTE,i),o&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,r,n,t.RGBA,t.UNSIGNED_BYTE,o)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=oe(this.readDepth(),r);return{width:r,height:n,rgba:oe(i,4*r),depth:a,normals:o&&oe(o,4*r)}}readBits(e,t){const{gl:r}=this,n=new Uint32Array(e*t);if(r.bindBuffer(r.PIXEL_PACK_BUFFER,null),r.pixelStorei(r.PACK_ALIGNMENT,1),r.getParameter(r.IMPLEMENTATION_COLOR_READ_FORMAT)===r.RED_INTEGER)r.readPixels(0,0,e,t,r.RED_INTEGER,r.UNSIGNED_INT,n);else{const i=new Uint32Array(4*e*t);r.readPixels(0,0,e,t,r.RGBA_INTEGER,r.UNSIGNED_INT,i);for(let o=0;o<n.length;o++)n[o]=i[4*o]}return new Float32Array(n.buffer)}wait(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.readBuffer(e.COLOR_ATTACHMENT0),e.readPixels(0,0,1,1,e.RGBA,e.UNSIGNED_BYTE,new Uint8Array(4)),e.bindFramebuffer(e.FRAMEBUFFER,null)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const r of Object.values(t))e.deleteTexture(r);e.deleteFramebuffer(this.framebuffer),this.forget()}readDepth(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.readBuffer(e.COLOR_ATTACHMENT1);const t=this.readBits(this.width,this.height);return e.bindFramebuffer(e.FRAMEBUFFER,null),t}texture(e,t){const{gl:r}=this,n=r.createTexture();return r.bindTexture(r.TEXTURE_2D,n),r.texStorage2D(r.TEXTURE_2D,1,e,this.width,this.height),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MIN_FILTER,t),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MAG_FILTER,t),r.bindTexture(r.TEXTURE_2D,null),n}}function oe(s,e){const t=s.length/e;for(let r=0;r<t>>1;r++){const[n,i]=[r*e,(t-1-r)*e],o=s.slice(n,n+e);s.copyWithin(n,i,i+e),s.set(o,i)}return s}const j=["colour","depth","opacity","normals"],Lt=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform sampler2D normals;
uniform vec2 size;
uniform vec2 reach;
uniform int view;
out vec4 colour;
void main() {
  vec2 at = gl_FragCoord.xy / size;
  vec4 c = texture(picture, at);
  if (view == ${j.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${j.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${j.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  colour = vec4(c.rgb, 1.0);
}`,Bt=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform int stride;
uniform int height;
out uint bits;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) * stride;
  at.y = height - 1 - at.y;
  bits = texelFetch(picture, at, 0).a > 0.5 ? texelFetch(depthBits, at, 0).r : 0x7f800000u;
}`;class De{constructor(e,t){this.gl=e,this.targets=t}programs=null;small=null;show(e,t,r,n){const{gl:i}=this,{program:o,uniform:a}=this.cached.show;i.viewport(0,0,r,n),i.useProgram(o),this.bind(a),i.activeTexture(i.TEXTURE2),i.bindTexture(i.TEXTURE_2D,this.targets.normals),i.uniform1i(a("normals"),2),i.uniform2f(a("size"),r,n),i.uniform2f(a("reach"),...t),i.uniform1i(a("view"),j.indexOf(e)),i.drawArrays(i.TRIANGLES,0,3)}distances(e){const{gl:t,targets:r}=this,n=Math.max(1,Math.ceil(Math.sqrt(r.width*r.height/e))),[i,o]=[Math.ceil(r.width/n),Math.ceil(r.height/n)];this.bindSmall(i,o);const{program:a,uniform:c}=this.cached.distances;return t.viewport(0,0,i,o),t.useProgram(a),this.bind(c),t.uniform1i(c("stride"),n),t.uniform1i(c("height"),r.height),t.drawArrays(t.TRIANGLES,0,3),t.readBuffer(t.COLOR_ATTACHMENT0),{width:i,height:o,values:r.readBits(i,o)}}forget(){this.programs=this.small=null}dispose(){const{gl:e}=this;for(const{program:t}of Object.values(this.programs??{}))e.deleteProgram(t);e.deleteTexture(this.small?.texture??null),e.deleteFramebuffer(this.small?.framebuffer??null),this.forget()}get cached(){return this.programs??={show:O(this.gl,C,Lt),distances:O(this.gl,C,Bt)},this.programs}bind(e){const{gl:t,targets:r}=this;t.activeTexture(t.TEXTURE0),t.bindTexture(t.TEXTURE_2D,r.colour),t.uniform1i(e("picture"),0),t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,r.depth),t.uniform1i(e("depthBits"),1)}bindSmall(e,t){const{gl:r}=this;if(this.small?.width!==e||this.small.height!==t){r.deleteTexture(this.small?.texture??null),r.deleteFramebuffer(this.small?.framebuffer??null);const n=r.createTexture();r.bindTexture(r.TEXTURE_2D,n),r.texStorage2D(r.TEXTURE_2D,1,r.R32UI,e,t);const i=r.createFramebuffer();r.bindFramebuffer(r.FRAMEBUFFER,i),r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0,r.TEXTURE_2D,n,0),this.small={texture:n,framebuffer:i,width:e,height:t}}r.bindFramebuffer(r.FRAMEBUFFER,this.small.framebuffer),r.drawBuffers([r.COLOR_ATTACHMENT0])}}const Ct=768*2**20;class ae{constructor(e,t=Ct){this.gl=e,this.memory=t,this.targets=new Oe(e),this.views=new De(e,this.targets),this.onGpu=new pt(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;inBands=!0;inOrder=!0;editable=!0;compileTime=0;compiled=0;shown=null;onGpu;views;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shown?.level??null}get uploaded(){return this.onGpu.uploaded}get active(){return this.edited?this.onGpu.edits:null}get bytes(){return this.shown?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const r=++this.loading,n=()=>r===this.loading;let i=0;for await(const o of gt(e,t.onArrival)){if(await this.take(o,n),!n())return;t.onLevel?.(++i,o.field.levels.length)}}async restore(){const{shown:e}=this,{edits:t}=this.onGpu;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shown=null;for(const n of[this.targets,this.views,this.onGpu])n.forget();const r=++this.loading;this.setEdits(t),e&&await this.take(e.level,()=>r===this.loading)}setEdits(e){this.onGpu.set(e),this.putLayers()}render(e={}){const{gl:t,shown:r,camera:n,active:i}=this;if(!r||!n||t.isContextLost())return!1;const{level:o,textures:a}=r,{width:c,height:l}=this.targets,h={K:o.header.steps.length,contracted:o.field.contracted,edited:i!==null,edits:i&&ft(i.edits),normals:e.normals??!1,count:e.count??!1},{program:u,uniform:d}=this.program(h,o.field.brick);this.targets.bind(h.normals),t.useProgram(u),t.bindVertexArray(this.vertices),z(this.gl);const f=i&&o.last?i.occupancy:o.occupancy;At(t,d,o,a.layout,f,this.step??o.field.step),_t(t,d,n,this.targets),t.uniform1f(d("near"),this.near),t.uniform3f(d("background"),...this.background);let m=0;const p=(T,y,E)=>{t.activeTexture(t.TEXTURE0+m),t.bindTexture(y,E),t.uniform1i(d(T),m++)};p("densityAtlas",t.TEXTURE_3D,a.density),p("brickIndex",t.TEXTURE_3D,a.index),p("bricks",t.TEXTURE_3D,i?o.last?this.onGpu.bricks:r.withoutLeaps:r.occupancy),a.colours.forEach((T,y)=>p(`colourAtlas${y}`,t.TEXTURE_3D,T)),i&&(p("lattice",t.TEXTURE_2D,this.onGpu.bind(u)),t.uniform1i(d("editCount"),i.edits),t.uniform1i(d("boxCount"),i.boxes),t.uniform1i(d("preserveOpacity"),Number(i.preserveOpacity)),t.uniform1i(d("layered"),Number(r.layered)));const{first:x,count:w}=e.rows??{first:0,count:l},g=e.columns??{first:0,count:c};return t.enable(t.SCISSOR_TEST),t.scissor(g.first,x,g.count,w),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),k(t),!0}show(e,t,r=null,n="colour"){const{gl:i}=this;i.bindFramebuffer(i.FRAMEBUFFER,r),i.bindVertexArray(this.vertices),z(this.gl),this.views.show(n,this.reach,e,t),k(this.gl)}read(e=!1){return this.targets.read(e)}distances(e){this.gl.bindVertexArray(this.vertices),z(this.gl);const t=this.views.distances(e);return k(this.gl),t}wait(){this.targets.wait()}dispose(){this.loading++,this.drop();for(const e of[this.targets,this.views,this.onGpu])e.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const r=await ie.upload(this.gl,this.memory,e,this.layers,t);r!==null&&(this.drop(),this.shown=r,this.putLayers())}get layers(){return this.onGpu.edits?.layers??[]}putLayers(){try{this.shown&&this.onGpu.count(this.shown.putLayers(this.layers))}catch(e){throw e instanceof ye&&this.drop(),e}}drop(){this.shown?.dispose(),this.shown=null}get reach(){const{shown:e,camera:t}=this;return!e||!t?[0,1]:ge(e.level.field.bounds,t)}program(e,t){const r=JSON.stringify([e,t]);let n=this.programs.get(r);return n||(n=O(this.gl,C,Rt(e,t)),this.programs.set(r,n),this.compileTime=n.milliseconds,this.compiled+=1),n}}async function Fe(s,e=null){const t=await A.open(new F(s),"cageedit",3),{header:r}=t,n=await t.read("rows"),i=[];for(const[f,{key:m}]of r.lattices.entries()){const p=[...i,...e?.lattices??[]].find(x=>x.key===m);i.push(p??{key:m,halves:Q(await t.read(`lattice.${f}`))})}const o=[];for(const[f,{key:m,...p}]of r.layers.entries()){const x=[...o,...e?.layers??[]].find(({layer:w})=>w.key===m);o.push({layer:x?.layer??await _e(t,`layer.${f}`,m),...p})}const{key:a,origin:c,dims:l,part:h}=r.occupancy,u=e?.occupancy??null;let d;if(u?.key===a)d=u;else{const f=await t.read("occupancy");if(h===null)d={key:a,origin:c,dims:l,codes:f,changed:null};else if(u?.key===h.of)d={key:a,origin:c,dims:l,codes:Pt(u,h.low,h.dims,f),changed:{...h,codes:f}};else throw new Error("the edits are the change of ones that this page has not")}return{edits:r.edits,boxes:r.boxes,preserveOpacity:r.preserve_opacity,rows:n,lattices:i,layers:o,occupancy:d}}function Pt({dims:s,codes:e},t,r,n){const i=e.slice();let o=0;for(let a=t[0];a<t[0]+r[0];a++)for(let c=t[1];c<t[1]+r[1];c++,o+=r[2])i.set(n.subarray(o,o+r[2]),(a*s[1]+c)*s[2]+t[2]);return i}const ze="cagespla",Gt=1,$t=256,_=8;function G(s){return 4*Math.ceil(3*((s+1)**2-1)/16)}async function*Xt(s,e,t){const r=new F(s,t);try{const n=await A.open(r,ze,Gt),{header:i}=n;e(i);let o=0;for(const[a,c]of i.levels.entries()){const l=c-o,h=async T=>await n.read(`${a}.${T}`),u=await n.read(`${a}.chunks`),d=Wt(u,await h("means"),l),f=await h("rotations"),m=await h("scales"),p=await h("opacities"),x=await h("colours"),w=qt(d,U(f),U(m),U(p),U(x)),g=Ht(await h("sh"),l,i.degree);yield{header:i,first:o,count:l,last:a===i.levels.length-1,means:d,records:w,harmonics:g},o=c}}finally{r.cancel()}}function U(s){const e=s.length/2,t=new Uint16Array(e);for(let r=0;r<e;r++)t[r]=s[r]<<8|s[e+r];return t}function Wt(s,e,t){const r=e.length/(3*t),n=256**r-1,i=new Float32Array(3*t);for(let o=0;o<t;o++){const a=6*Math.floor(o/$t);for(let c=0;c<3;c++){let l=0;for(let u=0;u<r;u++)l=256*l+e[(3*u+c)*t+o];const h=s[a+c];i[3*o+c]=h+(s[a+3+c]-h)*l/n}}return i}function qt(s,e,t,r,n){const i=r.length,o=new Uint32Array(s.buffer),a=new Uint32Array(_*i);for(let c=0;c<i;c++){const l=_*c;a[l]=o[3*c],a[l+1]=o[3*c+1],a[l+2]=o[3*c+2],a[l+3]=n[c]|n[i+c]<<16,a[l+4]=e[c]|e[i+c]<<16,a[l+5]=e[2*i+c]|r[c]<<16,a[l+6]=t[c]|t[i+c]<<16,a[l+7]=t[2*i+c]|n[2*i+c]<<16}return a}function Ht(s,e,t){const r=4*G(t),n=new Uint8Array(r*e),i=3*((t+1)**2-1);for(let o=0;o<i;o++)for(let a=0;a<e;a++)n[r*a+o]=s[e*o+a];return new Uint32Array(n.buffer)}const ke="cagesped",Vt=2,K=16,jt=524800|512<<20;async function Ne(s){const e=await A.open(new F(s),ke,Vt),{count:t,changed:r}=e.header,n=Ie(await e.read("hidden"),t),i=await e.read("sources"),o=await e.read("means"),a=await e.read("covariances"),c=U(await e.read("opacities")),l=U(await e.read("turns")),h=await e.read("gains");return{count:t,hidden:n,changed:r,means:o,records:Le(i,o,a,c,l,h)}}function Ie(s,e){const t=new Uint8Array(e);for(let r=0;r<e;r++)t[r]=s[r>>3]>>(r&7)&1;return t}function Le(s,e,t,r,n,i){const o=s.length,a=new Uint32Array(K*o),[c,l]=[new Uint32Array(e.buffer),new Uint32Array(t.buffer)];for(let h=0;h<o;h++){const u=K*h;for(let d=0;d<3;d++)a[u+d]=c[3*h+d];a[u+3]=s[h];for(let d=0;d<6;d++)a[u+4+d]=l[6*h+d];a[u+10]=n[h]|n[o+h]<<16,a[u+11]=n[2*o+h]|r[h]<<16,a[u+12]=i?i[h]:jt}return a}const v=2048,ce=3,Kt=`
uniform usampler2D order;       // numbers of splats, from far to near
uniform uint count;             // of them
uniform usampler2D records, harmonics, changed;
uniform uint own;               // splats of the field; numbers from it on are changed ones
uniform vec3 eye;               // less the field's centre
uniform mat3 W;                 // rows: x right, y down, z forward
uniform vec2 focal, centre, size;
uniform vec4 limits;            // of (x, y) / z: low, high of x, of y
uniform float near, logLow, logStep, colourStep;

// Mean in pixels, x right and y down; A, k of the conic A (x + k y)^2 + D y^2.
layout(location = 0) out uvec4 place;
// D, opacity (0: not shown), distance, its slope along x.
layout(location = 1) out uvec4 shape;
// Colour, slope of the distance along y.
layout(location = 2) out uvec4 tint;

const float BLUR = 0.3, SLOPE_BLUR = 0.02, ALPHA_MIN = 1.0 / 255.0, LEAST_COMPENSATION = 0.005;

uvec4 texel(usampler2D from, uint n) { return texelFetch(from, ivec2(n % ${v}u, n / ${v}u), 0); }

// The quaternion (w, x, y, z as its y, z, w, x: xyz and w) of three numbers of 15 bits; see page_splats.encode_rotations.
vec4 rotation(uvec2 words) {
  uvec3 codes = uvec3(words.x & 65535u, words.x >> 16, words.y & 65535u);
  uint left = (codes.x >> 15) | (codes.y >> 15) << 1;
  vec3 c = (vec3(codes & 32767u) - 16384.0) / (16383.0 * sqrt(2.0));
  float most = sqrt(max(0.0, 1.0 - dot(c, c)));
  if (left == 0u) return vec4(c, most);
  if (left == 1u) return vec4(most, c.y, c.z, c.x);
  if (left == 2u) return vec4(c.y, most, c.z, c.x);
  return vec4(c.y, c.z, most, c.x);
}

vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

mat3 cholesky(float xx, float xy, float xz, float yy, float yz, float zz) {
  float a = sqrt(max(xx, 1e-38));
  float b = xy / a, c = xz / a;
  float d = sqrt(max(yy - b * b, 0.0));
  float e = d > 1e-6 * a ? (yz - b * c) / d : 0.0;
  float f = sqrt(max(zz - c * c - e * e, 0.0));
  return mat3(a, b, c, 0.0, d, e, 0.0, 0.0, f);
}
`,Yt=`
void main() {
  place = shape = tint = uvec4(0u);
#ifdef NORMALS
  normal = uvec4(0u);
#endif
  ivec2 here = ivec2(gl_FragCoord.xy);
  if (uint(here.y * ${v} + here.x) >= count) return;
  uint splat = texelFetch(order, here, 0).r;
  uint source = splat;
  vec3 mean;
  mat3 F;
  float o;
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  vec3 gain = vec3(1.0);
  if (splat < own) {
    uvec4 first = texel(records, 2u * splat), second = texel(records, 2u * splat + 1u);
    mean = uintBitsToFloat(first.xyz);
    o = float(second.y >> 16) / 65535.0;
    vec3 s = exp(logLow + logStep * vec3(second.z & 65535u, second.z >> 16, second.w & 65535u));
    vec4 q = rotation(second.xy);
    F = mat3(s.x * rotated(q, vec3(1, 0, 0)), s.y * rotated(q, vec3(0, 1, 0)), s.z * rotated(q, vec3(0, 0, 1)));
  } else {
    uint n = 4u * (splat - own);
    uvec4 first = texel(changed, n), second = texel(changed, n + 1u), third = texel(changed, n + 2u);
    mean = uintBitsToFloat(first.xyz);
    source = first.w;
    vec4 C = uintBitsToFloat(second);
    F = cholesky(C.x, C.y, C.z, C.w, uintBitsToFloat(third.x), uintBitsToFloat(third.y));
    turn = rotation(third.zw);
    o = float(third.w >> 16) / 65535.0;
    uint gains = texel(changed, n + 3u).x;
    gain = exp2((vec3(gains & 1023u, gains >> 10 & 1023u, gains >> 20) - 512.0) / 128.0);
  }
  vec3 offset = mean - eye;
  vec3 p = W * offset;
  if (p.z < near || o <= ALPHA_MIN) return;
  vec2 n = clamp(p.xy / p.z, limits.xz, limits.yw);
  vec3 rowX = vec3(W[0].x, W[1].x, W[2].x), rowY = vec3(W[0].y, W[1].y, W[2].y), rowZ = vec3(W[0].z, W[1].z, W[2].z);
  vec3 N0 = (focal.x / p.z * (rowX - n.x * rowZ)) * F;
  vec3 N1 = (focal.y / p.z * (rowY - n.y * rowZ)) * F;
  float a = dot(N0, N0), b = dot(N0, N1), c = dot(N1, N1);
  vec3 area = cross(N0, N1);
  float sharp = dot(area, area);
  float det = sharp + BLUR * (a + c + BLUR);
  float slopeDet = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR);
#ifdef ANTIALIASED
  o *= max(LEAST_COMPENSATION, sqrt(sharp / det));
#endif
  float reach = 2.0 * log(o / ALPHA_MIN);
  if (!(reach > 0.0)) return;
  vec2 at = p.xy / p.z * focal + centre;
  vec2 extent = sqrt(reach * (vec2(a, c) + BLUR));
  if (any(lessThanEqual(at + extent, vec2(0.0))) || any(greaterThanEqual(at - extent, size))) return;
  place = floatBitsToUint(vec4(at, (c + BLUR) / det, -b / (c + BLUR)));
  float distance = length(offset);
  vec3 d = offset / distance;
  vec3 along = d * F;
  float alongU = dot(along, N0), alongV = dot(along, N1);
  vec2 slope = vec2(alongU * (c + SLOPE_BLUR) - alongV * b, alongV * (a + SLOPE_BLUR) - alongU * b) / slopeDet;
  shape = floatBitsToUint(vec4(1.0 / (c + BLUR), o, distance, slope.x));
#ifdef NORMALS
  vec3 axis = flattest(F);
  normal = floatBitsToUint(vec4(dot(axis, d) > 0.0 ? -axis : axis, 0.0));
#endif
  d = rotated(vec4(-turn.xyz, turn.w), d);
  tint = floatBitsToUint(vec4(gain * max(colourOf(source, d), 0.0), slope.y));
}
`,Zt=`
layout(location = 3) out uvec4 normal;
vec3 flattest(mat3 F) {
  mat3 C = F * transpose(F);
  mat3 B = mat3(cross(C[1], C[2]), cross(C[2], C[0]), cross(C[0], C[1]));
  for (int n = 0; n < 8; n++) {
    B /= max(B[0][0] + B[1][1] + B[2][2], 1e-37);
    B = B * B;
  }
  vec3 length2 = vec3(dot(B[0], B[0]), dot(B[1], B[1]), dot(B[2], B[2]));
  vec3 axis = length2.x >= length2.y && length2.x >= length2.z ? B[0] : length2.y >= length2.z ? B[1] : B[2];
  return axis / max(length(axis), 1e-37);
}
`;function Jt(s){const e=G(s)/4,t=(s+1)**2,r=[...s>0?[`uniform float steps[${t-1}];`]:[],"vec3 colourOf(uint splat, vec3 d) {","  uvec2 last = texel(records, 2u * splat + 1u).zw;","  uint both = texel(records, 2u * splat).w;",`  vec3 rgb = 0.5 + ${ee[0]} * colourStep * (vec3(both & 65535u, both >> 16, last.y >> 16) - 32768.0);`,...Array.from({length:e},(n,i)=>`  uvec4 t${i} = texel(harmonics, ${e}u * splat + ${i}u);`)];for(let n=1;n<t;n++){const i=[0,1,2].map(o=>{const a=3*(n-1)+o;return`(t${a>>4}.${"xyzw"[a>>2&3]} >> ${8*(a&3)} & 255u)`});r.push(`  rgb += (steps[${n-1}] * (${ee[n]})) * (vec3(${i.join(", ")}) - 128.0);`)}return[...r,"  return rgb;","}"].join(`
`)}function Qt(s){return["#version 300 es","precision highp float;","precision highp int;","precision highp usampler2D;",...s.antialiased?["#define ANTIALIASED"]:[],...s.normals?["#define NORMALS"]:[],Kt,s.normals?Zt:"",Jt(s.degree),Yt].join(`
`)}const er=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D places, shapes, tints;
uniform vec2 size;
flat out vec4 where;
flat out vec4 how;
flat out vec4 colour;
#ifdef NORMALS
uniform usampler2D normals;
flat out vec3 axis;
#endif
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  int splat = gl_VertexID / 6, side = gl_VertexID - 6 * splat;
  ivec2 here = ivec2(splat % ${v}, splat / ${v});
  how = uintBitsToFloat(texelFetch(shapes, here, 0));
  if (how.y <= 0.0) return;
  where = uintBitsToFloat(texelFetch(places, here, 0));
  colour = uintBitsToFloat(texelFetch(tints, here, 0));
#ifdef NORMALS
  axis = uintBitsToFloat(texelFetch(normals, here, 0)).xyz;
#endif
  float reach = 2.0 * log(255.0 * how.y);
  // Two triangles: corners 0 1 2 and 3 2 1.
  int number = side < 3 ? side : 6 - side;
  vec2 corner = vec2(float(number & 1), float(number >> 1)) * 2.0 - 1.0;
  vec2 at = corner * (sqrt(reach / vec2(where.z, how.x)) + 0.01);
  at = where.xy + vec2(at.x - where.w * at.y, at.y);
  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);
}`,tr=`#version 300 es
precision highp float;
flat in vec4 where;
flat in vec4 how;
flat in vec4 colour;
uniform vec2 size;
uniform float unit;                 // of distances
layout(location = 0) out vec4 outColour;
layout(location = 1) out vec4 outDepth;
#ifdef NORMALS
flat in vec3 axis;
layout(location = 2) out vec4 outNormal;
#endif
void main() {
  vec2 d = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - where.xy;
  float l = d.x + where.w * d.y;
  float q = where.z * l * l + how.x * d.y * d.y;
  float a = min(how.y * exp(-0.5 * q), 0.99);
  if (a < 1.0 / 255.0) discard;
  outColour = vec4(a * colour.rgb, a);
  outDepth = vec4(a * unit * (how.z + how.w * d.x + colour.w * d.y), 0.0, 0.0, a);
#ifdef NORMALS
  outNormal = vec4(a * (0.5 + 0.5 * axis), a);
#endif
}`,rr=`#version 300 es
precision highp float;
precision highp int;
uniform sampler2D gathered, distances;
uniform vec3 background;
uniform float unit;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
uniform sampler2D axes;
layout(location = 2) out vec4 outNormal;
#endif
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(gathered, at, 0);
  outColour = eightBits(vec4(sum.rgb + (1.0 - sum.a) * background, sum.a));
  float distance = texelFetch(distances, at, 0).r / unit;
  outDepth = floatBitsToUint(sum.a > 1e-6 ? distance / sum.a : intBitsToFloat(0x7f800000));
#ifdef NORMALS
  vec4 both = texelFetch(axes, at, 0);
  vec3 normal = 2.0 * both.rgb - both.a;
  float length_ = length(normal);
  outNormal = eightBits(vec4(length_ > 1e-3 ? 0.5 + 0.5 * normal / length_ : vec3(0.5), sum.a));
#endif
}`;function le(s,e){const t=s.indexOf(`
`)+1;return s.slice(0,t)+e.map(r=>`#define ${r}
`).join("")+s.slice(t)}function Be(s){const e=s.getExtension("EXT_color_buffer_float");return e&&s.getExtension("EXT_float_blend")?{colour:s.RGBA16F,distance:s.R32F,isByte:!1}:e??s.getExtension("EXT_color_buffer_half_float")?{colour:s.RGBA16F,distance:s.RGBA16F,isByte:!1}:{colour:s.RGBA8,distance:s.RGBA8,isByte:!0}}class Ce{constructor(e,t){this.gl=e,this.formats=t}textures=null;framebuffer=null;width=0;height=0;begin(e,t,r){const{gl:n,formats:i}=this;if(this.textures&&(e!==this.width||t!==this.height||r&&!this.textures.normal)&&this.dispose(),!this.textures){this.width=e,this.height=t,this.textures={colour:this.texture(i.colour),distance:this.texture(i.distance),normal:r?this.texture(i.colour):null},this.framebuffer=n.createFramebuffer(),n.bindFramebuffer(n.FRAMEBUFFER,this.framebuffer);const{colour:o,distance:a,normal:c}=this.textures;for(const[l,h]of[o,a,c].entries())h&&n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+l,n.TEXTURE_2D,h,0)}n.bindFramebuffer(n.FRAMEBUFFER,this.framebuffer),n.drawBuffers([n.COLOR_ATTACHMENT0,n.COLOR_ATTACHMENT1,...r?[n.COLOR_ATTACHMENT2]:[]]),n.viewport(0,0,e,t);for(let o=0;o<(r?3:2);o++)n.clearBufferfv(n.COLOR,o,[0,0,0,0])}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const r of Object.values(t))e.deleteTexture(r);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e){const{gl:t}=this,r=t.createTexture();return t.bindTexture(t.TEXTURE_2D,r),t.texStorage2D(t.TEXTURE_2D,1,e,this.width,this.height),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.NEAREST),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),r}}class Pe{constructor(e){this.gl=e}order=null;outputs=[];framebuffer=null;rows=0;reserve(e,t){const{gl:r}=this,n=Math.ceil(e/v),i=ce+(t?1:0);if(n<=this.rows&&i<=this.outputs.length)return!1;const o=Math.max(i,this.outputs.length);this.rows=Math.max(n,this.rows),this.drop(),this.order=this.texture(r.R32UI),this.outputs=Array.from({length:o},()=>this.texture(r.RGBA32UI)),this.framebuffer=r.createFramebuffer(),r.bindFramebuffer(r.FRAMEBUFFER,this.framebuffer);for(const[a,c]of this.outputs.entries())r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0+a,r.TEXTURE_2D,c,0);return!0}put(e){const{gl:t}=this,r=Math.floor(e.length/v),n=e.length-r*v;R(t),t.bindTexture(t.TEXTURE_2D,this.order),t.texSubImage2D(t.TEXTURE_2D,0,0,0,v,r,t.RED_INTEGER,t.UNSIGNED_INT,e),n>0&&t.texSubImage2D(t.TEXTURE_2D,0,0,r,n,1,t.RED_INTEGER,t.UNSIGNED_INT,e,r*v),t.bindTexture(t.TEXTURE_2D,null)}bind(e,t){const{gl:r}=this;r.bindFramebuffer(r.FRAMEBUFFER,this.framebuffer),r.drawBuffers(this.outputs.map((n,i)=>i<ce||t?r.COLOR_ATTACHMENT0+i:r.NONE)),r.viewport(0,0,v,Math.ceil(e/v))}dispose(){this.drop(),this.rows=0}drop(){const{gl:e}=this;for(const t of[this.order,...this.outputs])e.deleteTexture(t);e.deleteFramebuffer(this.framebuffer),this.order=this.framebuffer=null,this.outputs=[]}texture(e){const{gl:t}=this,r=t.createTexture();return t.bindTexture(t.TEXTURE_2D,r),t.texStorage2D(t.TEXTURE_2D,1,e,v,this.rows),V(t,t.TEXTURE_2D,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),r}}const he=65536;function sr(s,e){const{means:t,hidden:r,changed:n}=s,[i,o,a]=e.axis,{offset:c,near:l}=e,h=t.length/3,u=h+(n?n.length/3:0),d=new Float32Array(u),f=new Uint32Array(d.buffer),m=new Uint32Array(u);let p=0;for(let y=0;y<h;y++){if(r!==null&&r[y]===1)continue;const E=i*t[3*y]+o*t[3*y+1]+a*t[3*y+2]+c;E<l||(d[p]=E,m[p++]=y)}if(n!==null)for(let y=h;y<u;y++){const E=3*(y-h),ht=i*n[E]+o*n[E+1]+a*n[E+2]+c;ht>=l&&(d[p]=ht,m[p++]=y)}const x=new Uint32Array(he),w=new Uint32Array(p),g=new Uint32Array(p);for(let y=0;y<p;y++)x[f[y]&65535]++;let T=0;for(let y=he-1;y>=0;y--){const E=x[y];x[y]=T,T+=E}for(let y=p-1;y>=0;y--)w[x[f[y]&65535]++]=y;x.fill(0);for(let y=0;y<p;y++)x[f[y]>>>16]++;T=0;for(let y=he-1;y>=0;y--){const E=x[y];x[y]=T,T+=E}for(let y=0;y<p;y++){const E=w[y];g[x[f[E]>>>16]++]=m[E]}return g}const Ge=`(function(){"use strict";function R(s,c){const{means:f,hidden:h,changed:r}=s,[d,U,b]=c.axis,{offset:g,near:m}=c,i=f.length/3,A=i+(r?r.length/3:0),w=new Float32Array(A),u=new Uint32Array(w.buffer),y=new Uint32Array(A);let e=0;for(let n=0;n<i;n++){if(h!==null&&h[n]===1)continue;const t=d*f[3*n]+U*f[3*n+1]+b*f[3*n+2]+g;t<m||(w[e]=t,y[e++]=n)}if(r!==null)for(let n=i;n<A;n++){const t=3*(n-i),I=d*r[t]+U*r[t+1]+b*r[t+2]+g;I>=m&&(w[e]=I,y[e++]=n)}const o=new Uint32Array(65536),p=new Uint32Array(e),D=new Uint32Array(e);for(let n=0;n<e;n++)o[u[n]&65535]++;let l=0;for(let n=65535;n>=0;n--){const t=o[n];o[n]=l,l+=t}for(let n=e-1;n>=0;n--)p[o[u[n]&65535]++]=n;o.fill(0);for(let n=0;n<e;n++)o[u[n]>>>16]++;l=0;for(let n=65535;n>=0;n--){const t=o[n];o[n]=l,l+=t}for(let n=0;n<e;n++){const t=p[n];D[o[u[t]>>>16]++]=y[t]}return D}let a=null;self.onmessage=({data:s})=>{if("set"in s){a=s.set;return}const c=a?R(a,s.sort):new Uint32Array(0);self.postMessage(c,{transfer:[c.buffer]})}})();
`,$e=typeof self<"u"&&self.Blob&&new Blob([Ge],{type:"text/javascript;charset=utf-8"});function nr(s){let e;try{if(e=$e&&(self.URL||self.webkitURL).createObjectURL($e),!e)throw"";const t=new Worker(e,{name:s?.name});return t.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(e)}),t}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent(Ge),{name:s?.name})}finally{e&&(self.URL||self.webkitURL).revokeObjectURL(e)}}const ir=32768;class Xe{onOrder=null;order=null;worker=null;posted=null;sorting=null;next=null;outdated=!1;of(e,t,r){const{order:n}=this,i=n?.set===e?n:null;return i!==null&&ue(i.depths,t)?i:i===null||r||e.means.length<=3*ir?(this.next=null,this.outdated=this.sorting!==null,this.order={numbers:sr(e,t),set:e,depths:t}):(this.ask(e,t),i)}dispose(){this.worker?.terminate(),this.worker=this.posted=this.sorting=this.next=this.order=null}ask(e,t){if(this.sorting!==null&&ue(this.sorting,t)&&this.posted===e){this.next=null;return}this.next=t,this.sorting===null&&(this.worker??=this.begun(),this.posted!==e&&(this.worker.postMessage({set:e}),this.posted=e),this.sorting=this.next,this.next=null,this.worker.postMessage({sort:this.sorting}))}begun(){const e=new nr;return e.onmessage=({data:t})=>{const{sorting:r,posted:n,order:i,next:o,outdated:a}=this;this.sorting=null,this.outdated=!1,!(r===null||n===null||i?.set!==n||a)&&(this.order={numbers:t,set:n,depths:r},o&&this.ask(n,o),this.onOrder?.())},e}}function ue(s,e){return s.offset===e.offset&&s.near===e.near&&s.axis.every((t,r)=>t===e.axis[r])}const We=128;class ${constructor(e,t){this.gl=e,this.rows=Math.max(1,Math.ceil(t/(4*v)));const r=J(e,e.MAX_TEXTURE_SIZE);if(this.rows>r)throw new N(`the splats take ${this.rows} rows of a texture, more than the ${r} that the GPU has`);for(;e.getError()!==e.NO_ERROR;);if(this.texture=e.createTexture(),e.bindTexture(e.TEXTURE_2D,this.texture),e.texStorage2D(e.TEXTURE_2D,1,e.RGBA32UI,v,this.rows),V(e,e.TEXTURE_2D,e.NEAREST),e.bindTexture(e.TEXTURE_2D,null),e.getError()===e.OUT_OF_MEMORY)throw this.dispose(),new Error("the GPU has not enough memory for the splats")}texture;rows;stride=4*v;async put(e,t,r,n){const{stride:i}=this;for(let o=Math.floor(t/i);o*i<r;o+=We){if(o*i>t&&await new Promise(a=>setTimeout(a)),!n())return;this.putRows(e,o,Math.min(o+We,Math.ceil(r/i)))}}putRows(e,t,r){const{gl:n,stride:i}=this;let o=e.subarray(t*i,r*i);if(o.length<(r-t)*i){const a=new Uint32Array((r-t)*i);a.set(o),o=a}R(n),n.bindTexture(n.TEXTURE_2D,this.texture),n.texSubImage2D(n.TEXTURE_2D,0,0,t,v,r-t,n.RGBA_INTEGER,n.UNSIGNED_INT,o),n.bindTexture(n.TEXTURE_2D,null)}dispose(){this.gl.deleteTexture(this.texture)}}const qe=16*(ce+1)+4;class or{constructor(e,t,r){this.gl=e,this.header=t;const{count:n,degree:i}=t,o=G(i);if(this.bytes=(4*(_+o)+qe)*n,this.bytes>r)throw new N(`the splats take ${Math.ceil(this.bytes/2**20)} MiB of the GPU, more than the ${Math.floor(r/2**20)} allowed`);this.means=new Float32Array(3*n),this.words=new Uint32Array(_*n),this.harmonicWords=new Uint32Array(o*n),this.set={means:this.means.subarray(0,0),hidden:null,changed:null},this.records=new $(e,this.words.length),this.harmonics=new $(e,this.harmonicWords.length)}set;records;harmonics;bytes;means;words;harmonicWords;get count(){return this.set.means.length/3}get isWhole(){return this.count===this.header.count}async take(e,t){this.means.set(e.means,3*e.first),this.words.set(e.records,_*e.first),this.harmonicWords.set(e.harmonics,G(e.header.degree)*e.first),await this.upload(e.first,e.first+e.count,t)}async restore(e){const{count:t}=this;this.records=new $(this.gl,this.words.length),this.harmonics=new $(this.gl,this.harmonicWords.length),this.set={...this.set,means:this.means.subarray(0,0)},await this.upload(0,t,e)}dispose(){this.records.dispose(),this.harmonics.dispose()}async upload(e,t,r){const n=G(this.header.degree);await this.records.put(this.words,_*e,_*t,r),r()&&await this.harmonics.put(this.harmonicWords,n*e,n*t,r),r()&&(this.set={means:this.means.subarray(0,3*t),hidden:null,changed:null})}}const ar=768*2**20,He=.3;class X{constructor(e,t=ar,r=null){this.gl=e,this.memory=t,this.targets=new Oe(e),this.views=new De(e,this.targets),this.vertices=e.createVertexArray(),this.formats=r??Be(e),this.gathering=new Ce(e,this.formats),this.projection=new Pe(e)}background=[1,1,1];near=0;edited=!0;targets;inBands=!1;inOrder=!0;level=null;uploaded={last:0,total:0};compileTime=0;compiled=0;views;sorters={before:new Xe,after:new Xe};formats;gathering;store=null;changed=null;camera=null;loading=0;programs=new Map;projection;vertices;ordered=null;set onOrder(e){for(const t of Object.values(this.sorters))t.onOrder=e}get editable(){return this.count>0}get count(){return this.store?.count??0}get bytes(){return this.store?.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const r=++this.loading,n=()=>r===this.loading;let i=0,o=null;const a=c=>{n()&&(o=new or(this.gl,c,this.memory))};try{for await(const c of Xt(e,a,t.onArrival)){const l=o;if(!n()||l===null||(await l.take(c,n),!n()))return;this.store!==l&&(this.store?.dispose(),this.store=l,this.ordered=null),this.level={field:{background:c.header.background},last:c.last},t.onLevel?.(++i,c.header.levels.length)}}finally{const c=o;c!==null&&this.store!==c&&c.dispose()}}async restore(){const{gl:e,store:t,changed:r}=this;this.programs.clear(),this.vertices=e.createVertexArray(),this.ordered=this.changed=null,this.projection=new Pe(e),this.targets.forget(),this.views.forget(),this.gathering=new Ce(e,Be(e));const n=++this.loading;await t?.restore(()=>n===this.loading),this.setEdits(r?.edits??null)}setEdits(e){if(this.changed?.texture.dispose(),this.changed=null,this.uploaded.last=0,e===null||e.changed===0&&!e.hidden.includes(1))return;if(this.store!==null&&e.count!==this.store.header.count)throw new Error(`edits of ${e.count} splats, the page has ${this.store.header.count}; reload it`);const t=this.bytes+(4*K+qe)*e.changed;if(t>this.memory)throw new N(`the edited splats take ${Ve(t)} MiB of the GPU, more than the ${Ve(this.memory)} allowed`);const r=new $(this.gl,e.records.length);e.changed>0&&r.putRows(e.records,0,Math.ceil(e.records.length/r.stride)),this.changed={edits:e,texture:r,set:null,own:null},this.uploaded.last=e.changed>0?e.records.byteLength:0,this.uploaded.total+=this.uploaded.last}render(e={}){const{gl:t,store:r,camera:n,gathering:i}=this;if(!r||r.count===0||!n||t.isContextLost())return!1;const{width:o,height:a}=this.targets,c=e.normals??!1,l=this.shown(r),h=this.depths(r,n),d=(l===r.set?this.sorters.before:this.sorters.after).of(l,h,e.sorted??!1);this.inOrder=ue(d.depths,h),z(t);const f=this.project(r,n,d,c),{first:m,count:p}=e.rows??{first:0,count:a},x=e.columns??{first:0,count:o};i.begin(o,a,c),t.enable(t.SCISSOR_TEST),t.scissor(x.first,m,x.count,p);const w=i.formats.isByte?1/this.farthest(r,n):1;return f>0&&this.blend(f,c,w),this.resolve(c,w),t.disable(t.SCISSOR_TEST),k(t),!0}show(e,t,r=null,n="colour"){const{gl:i}=this;i.bindFramebuffer(i.FRAMEBUFFER,r),i.bindVertexArray(this.vertices),z(i),this.views.show(n,this.reach,e,t),k(i)}read(e=!1){return this.targets.read(e)}distances(e){this.gl.bindVertexArray(this.vertices),z(this.gl);const t=this.views.distances(e);return k(this.gl),t}wait(){this.targets.wait()}dispose(){const{gl:e}=this;this.loading++,this.setEdits(null),this.store?.dispose(),this.store=this.ordered=this.level=null;for(const t of Object.values(this.sorters))t.dispose();this.views.dispose(),this.targets.dispose(),this.gathering.dispose(),this.projection.dispose();for(const{program:t}of this.programs.values())e.deleteProgram(t);this.programs.clear(),e.deleteVertexArray(this.vertices)}shown(e){const{changed:t}=this;return!this.edited||t===null?e.set:((t.set===null||t.own!==e.set)&&(t.own=e.set,t.set={means:e.set.means,hidden:t.edits.hidden,changed:cr(t.edits,e)}),t.set)}eye(e,{c2w:t}){const{centre:r}=e.header;return[t[3]-r[0],t[7]-r[1],t[11]-r[2]]}depths(e,t){const{c2w:r}=t,[n,i,o]=this.eye(e,t),a=[-r[2],-r[6],-r[10]];return{axis:a,offset:-(a[0]*n+a[1]*i+a[2]*o),near:Math.max(this.near,e.header.near)}}farthest(e,t){const[r,n]=e.header.bounds;return Math.hypot(...this.eye(e,t))+Math.hypot(...n.map((i,o)=>i-r[o]))}get reach(){const{store:e,camera:t}=this;return!e||!t?[0,1]:ge(e.header.bounds,t)}project(e,t,r,n){const{gl:i}=this,{degree:o,antialiased:a,steps:c,log_scales:l,colour_step:h}=e.header,u=r.numbers.length;if(u===0)return 0;const{program:d,uniform:f}=this.cached(`project${o}${a}${n}`,()=>O(i,C,Qt({degree:o,antialiased:a,normals:n}))),{projection:m}=this;return(m.reserve(u,n)||this.ordered!==r)&&m.put(r.numbers),this.ordered=r,m.bind(u,n),i.useProgram(d),i.bindVertexArray(this.vertices),this.setView(f,e,t),o>0&&i.uniform1fv(f("steps"),c),i.uniform1ui(f("own"),e.count),i.uniform1f(f("logLow"),l[0]),i.uniform1f(f("logStep"),(l[1]-l[0])/65535),i.uniform1f(f("colourStep"),h),i.uniform1ui(f("count"),u),this.bind(f,"order",m.order,0),this.bind(f,"records",e.records.texture,1),this.bind(f,"harmonics",e.harmonics.texture,2),this.bind(f,"changed",(this.changed?.texture??e.records).texture,3),i.drawArrays(i.TRIANGLES,0,3),u}blend(e,t,r){const{gl:n}=this,i=t?["NORMALS"]:[],{program:o,uniform:a}=this.cached(`blend${t}`,()=>O(n,le(er,i),le(tr,i)));n.useProgram(o),n.bindVertexArray(this.vertices),["places","shapes","tints",...t?["normals"]:[]].forEach((l,h)=>this.bind(a,l,this.projection.outputs[h],h)),n.uniform2f(a("size"),this.targets.width,this.targets.height),n.uniform1f(a("unit"),r),n.enable(n.BLEND),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ONE_MINUS_SRC_ALPHA),n.drawArrays(n.TRIANGLES,0,6*e),n.disable(n.BLEND)}resolve(e,t){const{gl:r}=this,{program:n,uniform:i}=this.cached(`resolve${e}`,()=>O(r,C,le(rr,e?["NORMALS"]:[])));this.targets.bind(e),r.useProgram(n),r.bindVertexArray(this.vertices);const{colour:o,distance:a,normal:c}=this.gathering.textures;this.bind(i,"gathered",o,0),this.bind(i,"distances",a,1),c&&e&&this.bind(i,"axes",c,2),r.uniform3f(i("background"),...this.background),r.uniform1f(i("unit"),t),r.drawArrays(r.TRIANGLES,0,3)}bind(e,t,r,n){const{gl:i}=this;i.activeTexture(i.TEXTURE0+n),i.bindTexture(i.TEXTURE_2D,r),i.uniform1i(e(t),n)}setView(e,t,r){const{gl:n}=this,{width:i,height:o}=this.targets,{c2w:a}=r,[c,l]=[r.fx,r.cx].map(p=>p*i/r.width),[h,u]=[r.fy,r.cy].map(p=>p*o/r.height),[d,f]=[.5*He*i/c,.5*He*o/h];n.uniform3f(e("eye"),...this.eye(t,r));const m=[a[0],-a[1],-a[2],a[4],-a[5],-a[6],a[8],-a[9],-a[10]];n.uniformMatrix3fv(e("W"),!1,m),n.uniform2f(e("focal"),c,h),n.uniform2f(e("centre"),l,u),n.uniform2f(e("size"),i,o),n.uniform4f(e("limits"),-l/c-d,(i-l)/c+d,-u/h-f,(o-u)/h+f),n.uniform1f(e("near"),Math.max(this.near,t.header.near))}cached(e,t){let r=this.programs.get(e);return r||(r=t(),this.programs.set(e,r),this.compileTime=r.milliseconds,this.compiled+=1),r}}const Ve=s=>Math.ceil(s/2**20);function cr({means:s,records:e,changed:t},r){if(r.isWhole)return s;const n=Float32Array.from(s);for(let i=0;i<t;i++)e[K*i+3]>=r.count&&(n[3*i]=NaN);return n}const je=new Map;function Ke(s){let e=je.get(s);if(!e){let t;const r=new ReadableStream({start:n=>void(t=n)});if(!t)throw new Error("a stream without a controller");je.set(s,e={stream:r,controller:t})}return e}function lr(s,e){document.currentScript?.remove();const{controller:t}=Ke(s);try{e===null?t.close():t.enqueue(hr(e))}catch{}}function hr(s){const e=atob(s),t=new Uint8Array(e.length);for(let r=0;r<e.length;r++)t[r]=e.charCodeAt(r);return t}async function de(s,{url:e}){if(e===void 0)return Ke(s).stream;if(location.protocol==="file:")throw new Error("A page may not read files beside it from a disk: open it by a web server (python -m http.server), or export one .html file.");const t=await fetch(e);if(!t.ok||t.body===null)throw new Error(`${e} cannot be loaded (${t.status}); reload the page.`);return t.body}async function Ye(s){return await new Response(s).arrayBuffer()}const fe=[1,.75,.5,.35,.25,.18,.12];class ur{constructor(e=28,t=40){this.moving=e,this.part=t}cost=null;took(e,t){const r=t/Math.max(1,e);this.cost=this.cost===null?r:this.cost+.3*(r-this.cost)}scale(e,t){const{cost:r}=this;return r===null?.25:fe.find(n=>r*e*t*n*n<=this.moving)??fe[fe.length-1]}rows(e,t){return this.cost===null?16:Math.max(4,Math.min(t,Math.floor(this.part/Math.max(1e-9,this.cost*e))))}}async function dr(s){const e=performance.now(),t=s.fenceSync(s.SYNC_GPU_COMMANDS_COMPLETE,0);if(s.flush(),t===null)return 0;for(;!s.isContextLost()&&s.clientWaitSync(t,0,0)===s.TIMEOUT_EXPIRED;)await new Promise(r=>setTimeout(r,1));return s.deleteSync(t),performance.now()-e}class fr{constructor(e,t){this.gl=e,this.memory=t,this.inner=new ae(e,t)}onOrder=null;inner;loading=0;get background(){return this.inner.background}set background(e){this.inner.background=e}get edited(){return this.inner.edited}set edited(e){this.inner.edited=e}get level(){return this.inner.level}get inBands(){return this.inner.inBands}get inOrder(){return this.inner.inOrder}get editable(){return this.inner.editable}get compiled(){return this.inner.compiled}get uploaded(){return this.inner.uploaded}setSize(e,t){this.inner.setSize(e,t)}setCamera(e){this.inner.setCamera(e)}async load(e,t={}){const r=++this.loading,{start:n,whole:i}=await pr(e);if(r!==this.loading){i instanceof ArrayBuffer||await i.cancel();return}const o=n===ze;if(o!==this.inner instanceof X){const{background:a,edited:c}=this.inner;this.inner.dispose(),this.inner=o?new X(this.gl,this.memory):new ae(this.gl,this.memory),Object.assign(this.inner,{background:a,edited:c}),this.inner instanceof X&&(this.inner.onOrder=()=>this.onOrder?.())}await this.inner.load(i,t)}async restore(){await this.inner.restore()}setEdits(e){if(this.inner instanceof X){if(e!==null&&!me(e))throw new Error("edits of voxels, the page shows splats; reload it");this.inner.setEdits(e)}else{if(me(e))throw new Error("edits of splats, the page shows voxels; reload it");this.inner.setEdits(e)}}render(e={}){return this.inner.render(e)}show(e,t,r=null,n="colour"){this.inner.show(e,t,r,n)}distances(e){return this.inner.distances(e)}wait(){this.inner.wait()}dispose(){this.loading++,this.inner.dispose()}}async function mr(s,e){return Y(new Uint8Array(s))===ke?await Ne(s):await Fe(s,me(e)?null:e)}function me(s){return s!==null&&"hidden"in s}function Y(s){return String.fromCharCode(...s.subarray(0,8))}async function pr(s){if(s instanceof ArrayBuffer)return{start:Y(new Uint8Array(s)),whole:s};const e=s.getReader(),t=[];let r=0;for(;r<8;){const{value:a,done:c}=await e.read();if(c)break;t.push(a),r+=a.length}const n=new Uint8Array(r);let i=0;for(const a of t)n.set(a,i),i+=a.length;const o=new ReadableStream({start:a=>a.enqueue(n),pull:async a=>{const{value:c,done:l}=await e.read();l?a.close():a.enqueue(c)},cancel:async a=>await e.cancel(a)});return{start:Y(n),whole:o}}const Ze=(s,e)=>Math.hypot(s.x-e.x,s.y-e.y);function xr(s,e){const t=new Map;let r=!1;const n=()=>{const i=[...t.values()];if(i.length===0)return;const o=i.slice(0,2),a=h=>o.reduce((u,{at:d,from:f})=>u+d[h]-f[h],0)/o.length,[c,l]=[a("x"),a("y")];if(o.length===2||o[0].shifts?(c!==0||l!==0)&&e.shift(c,l):(c!==0||l!==0)&&e.turn(c,l),o.length===2){const[h,u]=[Ze(o[0].from,o[1].from),Ze(o[0].at,o[1].at)];h>1&&u>1&&h!==u&&e.zoom(h/u)}for(const h of i)h.from=h.at};s.style.touchAction="none",s.addEventListener("contextmenu",i=>i.preventDefault()),s.addEventListener("pointerdown",i=>{s.setPointerCapture(i.pointerId),n();const o={x:i.clientX,y:i.clientY};t.set(i.pointerId,{at:o,from:o,shifts:i.button!==0||i.shiftKey})});for(const i of["pointerup","pointercancel"])s.addEventListener(i,o=>{n(),t.delete(o.pointerId)});s.addEventListener("pointermove",i=>{const o=t.get(i.pointerId);o&&(o.at={x:i.clientX,y:i.clientY},!r&&(r=!0,requestAnimationFrame(()=>{r=!1,n()})))}),s.addEventListener("wheel",i=>{i.preventDefault();const o=i.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;e.zoom(Math.exp(.0012*o*i.deltaY))},{passive:!1})}const b=(s,e,t=1)=>[s[0]+t*e[0],s[1]+t*e[1],s[2]+t*e[2]],M=(s,e)=>b(s,e,-1),Z=(s,e)=>[e*s[0],e*s[1],e*s[2]],I=(s,e)=>s[0]*e[0]+s[1]*e[1]+s[2]*e[2],W=(s,e)=>[s[1]*e[2]-s[2]*e[1],s[2]*e[0]-s[0]*e[2],s[0]*e[1]-s[1]*e[0]],Je=s=>Math.hypot(...s),L=s=>Z(s,1/Math.max(1e-30,Je(s)));function Qe(s,e,t){const[r,n]=[Math.cos(t),Math.sin(t)];return b(b(Z(s,r),W(e,s),n),e,I(e,s)*(1-r))}const S=(s,e)=>[s[e],s[4+e],s[8+e]];function et(s,e,t,r){return[0,1,2].flatMap(n=>[s[n],e[n],t[n],r[n]]).concat(0,0,0,1)}const tt=.02;class rt{constructor(e,t,r){this.up=t,this.eye=S(e,3);const n=Z(S(e,2),-1);this.target=b(this.eye,n,Math.max(I(M(r,this.eye),n),.001))}eye;target;get c2w(){const e=L(M(this.eye,this.target)),t=L(W(this.up,e));return et(t,W(e,t),e,this.eye)}turn(e,t){const r=Qe(M(this.eye,this.target),this.up,-e),n=L(W(this.up,r)),i=Math.acos(Math.max(-1,Math.min(1,I(L(r),this.up)))),o=Math.max(tt,Math.min(Math.PI-tt,i-t))-i;this.eye=b(this.target,Qe(r,n,o))}shift(e,t,r){const n=2*r*Je(M(this.eye,this.target)),{c2w:i}=this,o=b(Z(S(i,0),-e*n),S(i,1),t*n);this.eye=b(this.eye,o),this.target=b(this.target,o)}zoom(e){this.eye=b(this.target,M(this.eye,this.target),e)}}function yr({stills:s,seconds:e,loop:t},r){const n=e>0?r/e:1,i=s.length-1,o=t?n%1*s.length:Math.min(n,1)*i,a=s[Math.min(Math.floor(o),i)],c=s[t?(Math.floor(o)+1)%s.length:Math.min(Math.floor(o)+1,i)],l=o-Math.floor(o),h=m=>b(S(a.c2w,m),M(S(c.c2w,m),S(a.c2w,m)),l),u=L(h(2)),d=h(1),f=L(M(d,[u[0]*I(d,u),u[1]*I(d,u),u[2]*I(d,u)]));return{c2w:et(W(f,u),f,u,h(3)),fov_y_deg:a.fov_y_deg+l*(c.fov_y_deg-a.fov_y_deg)}}function st(s,e){const t=s.length-1;let r=0;for(;r<t-1&&s[r+1]<=e;)r++;const n=(e-s[r])/Math.max(1e-9,s[r+1]-s[r]);return{first:r,share:Math.max(0,Math.min(1,n))}}let q=null;function wr(){if(q)return q;q=new Float32Array(65536);for(let s=0;s<65536;s++){const e=s>>10&31,t=s&1023,r=e===0?t*2**-24:(1+t/1024)*2**(e-15);q[s]=s&32768?-r:r}return q}const nt=new Float32Array(1),it=new Uint32Array(nt.buffer);function gr(s){nt[0]=s;const e=it[0]>>>16&32768,t=it[0]&2147483647;return t>=947912704?e|t-939524096+4095+(t>>>13&1)>>>13:e|Math.round(Math.abs(s)*2**24)}function vr(s,e,t){const r=wr(),n=new Uint16Array(s.length);for(let i=0;i<n.length;i++){const o=r[s[i]];n[i]=gr(o+t*(r[e[i]]-o))}return n}const Er=[0,12,30];class pe{constructor(e,t,r,n,i){this.header=e,this.times=t,this.order=r,this.occupancy=n,this.states=i}static async read(e){const t=await A.open(new F(e),"cagepath",2),{header:r}=t,n=await t.read("times"),i=await t.read("states"),o=await t.read("occupancy"),a=[],c=[];for(const d of r.edits.keys())a.push(await t.read(`rows.${d}`));for(let d=0;d<r.stored;d++)c.push({key:`${d}`,halves:Q(await t.read(`lattice.${d}`))});const l=[];for(const[d,f]of r.layer_keys.entries())l.push(await _e(t,`layer.${d}`,f));const h=r.edits.map((d,f)=>{const m=r.layers[f].map(([p,x,w,g])=>({layer:l[p],place:x,first:w,end:g}));return{edits:d,boxes:r.boxes[f],rows:a[f],lattices:r.lattices[f].map(p=>c[p]),layers:m}}),u={key:"path",origin:r.origin,dims:r.dims,codes:o,changed:null};return new pe(r,n,i,u,h)}at(e){const{order:t,states:r}=this,{first:n,share:i}=st(this.times,e),o=r[t[n]],a=r[t[n+1]],c=i<.5?o:a;if(o===a||!Tr(o,a))return this.edits(c,c.rows,c.lattices);const l=o.lattices.map((h,u)=>h===a.lattices[u]?h:{key:`${h.key} ${a.lattices[u].key} ${i}`,halves:vr(h.halves,a.lattices[u].halves,i)});return this.edits(o,br(o,a,i),l)}edits({edits:e,boxes:t,layers:r},n,i){return{edits:e,boxes:t,preserveOpacity:this.header.preserve_opacity,rows:n,lattices:i,layers:r,occupancy:this.occupancy}}}function Tr(s,e){if(s.edits!==e.edits||s.boxes!==e.boxes)return!1;for(let t=3;t<s.rows.length;t+=4)if(s.rows[t]!==e.rows[t])return!1;return!0}function br({edits:s,boxes:e,rows:t},{rows:r},n){const i=t.map((a,c)=>a+n*(r[c]-a)),o=a=>{for(let c=4*a;c<4*a+3;c++)i[c]=Math.min(t[c],r[c]);for(let c=4*a+4;c<4*a+7;c++)i[c]=Math.max(t[c],r[c])};for(let a=0;a<s;a++)for(const c of Er)o(a*44+c);for(let a=0;a<e;a++)o(s*44+2*a);return i}const ot="cagesppa";class xe{constructor(e,t,r,n){this.header=e,this.times=t,this.order=r,this.states=n}unpacked=new Map;static async read(e){const t=await A.open(new F(e),ot,1),{header:r}=t,n=async u=>await t.read(u),i=async u=>U(await n(u)),o=await t.read("times"),a=await t.read("states"),c=[];for(let u=0;u<=Math.max(...r.hidden);u++)c.push(await n(`hidden.${u}`));const l=[];for(let u=0;u<=Math.max(...r.sources);u++)l.push(await t.read(`sources.${u}`));const h=[];for(const u of r.changed.keys())h.push({hidden:c[r.hidden[u]],sources:l[r.sources[u]],means:await i(`means.${u}`),rotations:await i(`rotations.${u}`),scales:await i(`scales.${u}`),opacities:await i(`opacities.${u}`),turns:await i(`turns.${u}`)});return new xe(r,o,a,h)}at(e){const{order:t,states:r,header:n}=this,{first:i,share:o}=st(this.times,e),[a,c]=[t[i],t[i+1]],l=o<.5?a:c;if((a===c||o===0||o===1)&&l===n.whole)return null;const h=r[l];let{means:u,covariances:d}=this.numbers(h);if(a!==c){const m=r[l===a?c:a],p=l===a?o:1-o,x=Rr(h.sources,m.sources),w=this.numbers(m);u=at(u,w.means,x,3,p),d=at(d,w.covariances,x,6,p)}const f=Le(h.sources,u,d,h.opacities,h.turns,null);return{count:n.count,hidden:Ie(h.hidden,n.count),changed:h.sources.length,means:u,records:f}}numbers(e){let t=this.unpacked.get(e);if(!t){t=Ar(e,this.header);for(const r of this.unpacked.keys())this.unpacked.size>1&&this.unpacked.delete(r);this.unpacked.set(e,t)}return t}}function Rr(s,e){const t=new Int32Array(s.length).fill(-1);let r=0;for(let n=0;n<s.length;n++){for(;r<e.length&&e[r]<s[n];)r++;r<e.length&&e[r]===s[n]&&(t[n]=r++)}return t}function at(s,e,t,r,n){const i=Float32Array.from(s);for(let o=0;o<t.length;o++)if(!(t[o]<0))for(let a=0;a<r;a++)i[r*o+a]+=n*(e[r*t[o]+a]-i[r*o+a]);return i}function Ar({means:s,rotations:e,scales:t},{low:r,high:n,log_scales:i}){const o=s.length/3,a={means:new Float32Array(3*o),covariances:new Float32Array(6*o)};for(let c=0;c<o;c++){for(let d=0;d<3;d++)a.means[3*c+d]=r[d]+(n[d]-r[d])*s[d*o+c]/65535;const l=_r(e[c],e[o+c],e[2*o+c]),h=[0,1,2].map(d=>Math.exp(2*(i[0]+(i[1]-i[0])*t[d*o+c]/65535)));let u=6*c;for(let d=0;d<3;d++)for(let f=d;f<3;f++){let m=0;for(let p=0;p<3;p++)m+=l[3*d+p]*h[p]*l[3*f+p];a.covariances[u++]=m}}return a}function _r(s,e,t){const r=s>>15|e>>15<<1,n=[s,e,t].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),i=Math.sqrt(Math.max(0,1-n[0]**2-n[1]**2-n[2]**2)),[o,a,c,l]=[...n.slice(0,r),i,...n.slice(r)];return[1-2*(c*c+l*l),2*(a*c-o*l),2*(a*l+o*c),2*(a*c+o*l),1-2*(a*a+l*l),2*(c*l-o*a),2*(a*l-o*c),2*(c*l+o*a),1-2*(a*a+c*c)]}const ct=120,Ur=2;class Mr{constructor(e,t,r,n=()=>{}){this.canvas=e,this.header=t,this.say=r,this.arrived=n;const i=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!i)throw new Error("This browser has no WebGL2, which the scene is drawn with.");this.gl=i,this.renderer=new fr(i),this.renderer.background=t.background??[1,1,1],this.orbit=new rt(t.start.c2w,t.up,t.centre),this.fov=t.start.fov_y_deg,xr(e,{turn:(o,a)=>this.change(()=>this.orbit.turn(Math.PI*o/e.clientHeight,Math.PI*a/e.clientHeight)),shift:(o,a)=>this.change(()=>this.orbit.shift(o/e.clientHeight,a/e.clientHeight,this.tangent)),zoom:o=>this.change(()=>this.orbit.zoom(o))}),e.addEventListener("webglcontextlost",o=>o.preventDefault()),e.addEventListener("webglcontextrestored",()=>void this.renderer.restore().then(()=>this.touch())),new ResizeObserver(()=>this.touch()).observe(e)}renderer;orbit;gl;pacing=new ur;fov;moved=performance.now();row=0;sketched=!1;pictures=0;playing=null;edits;along=null;canPlay=!1;async run(){const{files:e}=this.header;this.draw();const t=await de("field",e.field);let r;await this.renderer.load(t,{onArrival:n=>this.arrived(Math.min(.99,n/e.field.bytes)),onLevel:(n,i)=>{this.say(n<i?"Loading detail …":""),r??=this.loadEdits(),this.touch()}}),await r,e.path&&(this.along=await Sr(await Ye(await de("path",e.path)))),this.canPlay=this.header.path!==null,this.arrived(1)}async loadEdits(){const{files:e}=this.header;this.edits=e.edits?await mr(await Ye(await de("edits",e.edits)),null):null,this.renderer.setEdits(this.edits),this.touch()}get whole(){return this.row===null}get edited(){return this.renderer.edited}set edited(e){this.renderer.edited=e,this.touch()}get plays(){return this.playing!==null}play(e){this.playing=e&&this.canPlay?performance.now():null,this.touch()}home(){this.playing=null,this.edits!==void 0&&this.renderer.setEdits(this.edits),this.look(this.header.start)}seek(e,t){const r=e.loop?t%e.seconds:Math.min(t,e.seconds);this.along&&this.renderer.setEdits(this.along.at(r)??this.edits??null),this.look(yr(e,r))}get tangent(){return Math.tan(this.fov*Math.PI/360)}look(e){this.orbit=new rt(e.c2w,this.header.up,this.header.centre),this.fov=e.fov_y_deg,this.touch()}change(e){this.playing=null,e(),this.touch()}touch(){this.moved=performance.now(),this.row=0,this.sketched=!1}async draw(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{await this.frame()}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}async frame(){const{canvas:e,gl:t,renderer:r,pacing:n}=this,{path:i}=this.header;if(this.playing!==null&&i){const w=(performance.now()-this.playing)/1e3;this.seek(i,w),!i.loop&&w>=i.seconds&&(this.playing=null)}if(this.row===null||r.level?.last&&this.edits===void 0)return;const o=Math.min(devicePixelRatio,Ur),[a,c]=[e.clientWidth,e.clientHeight].map(w=>Math.max(1,Math.round(w*o)));(e.width!==a||e.height!==c)&&Object.assign(e,{width:a,height:c});const l=n.scale(a,c),h=this.sketched&&performance.now()-this.moved>ct||l===1,u=h?[a,c]:[a,c].map(w=>Math.max(8,Math.round(w*l)));this.aim(u[0],u[1]);const d=h?this.row:0,f=h&&r.inBands?Math.min(n.rows(a,c),c-d):u[1],m=this.moved,p=performance.now()-m>ct;if(!r.render({rows:{first:d,count:f},sorted:p}))return;const x=d+f>=u[1];x&&(r.show(a,c),this.pictures++),n.took(u[0]*f,await dr(t)),this.moved===m&&(this.sketched=!0,h&&(this.row=x?r.inOrder?null:0:d+f))}aim(e,t){const r=.5*Math.min(e,t)/this.tangent;this.renderer.setSize(e,t),this.renderer.setCamera({c2w:this.orbit.c2w,width:e,height:t,fx:r,fy:r,cx:e/2,cy:t/2})}}async function Sr(s){return Y(new Uint8Array(s))===ot?await xe.read(s):await pe.read(s)}window.cagefieldViewer={FieldRenderer:ae,readEdits:Fe,SplatRenderer:X,readSplatEdits:Ne,take:lr};function B(s){const e=document.querySelector(s);if(!e)throw new Error(`the page has no ${s}`);return e}async function Or(s){const e=B(".message"),t=B(".arrived"),r=n=>void(e.textContent=n);try{const n=new Mr(B("canvas"),s,r,c=>{t.value=c,t.hidden=c>=1});window.cagefieldViewer.viewer=n;const[i,o,a]=[B(".compare"),B(".play"),B(".home")];i.hidden=!s.files.edits,i.onclick=()=>n.edited=!n.edited,o.onclick=()=>n.play(!n.plays),a.onclick=()=>n.home(),setInterval(()=>{o.hidden=!n.canPlay,o.textContent=n.plays?"Stop":"Play",i.textContent=n.edited?"Show before":"Show after"},100),window.addEventListener("keydown",({key:c,target:l})=>{c==="b"&&i.click(),c===" "&&!(l instanceof HTMLButtonElement)&&o.click(),c==="h"&&a.click()}),await n.run()}catch(n){t.hidden=!0,r(n instanceof Error?n.message:String(n))}}const lt=document.getElementById("scene");lt&&Or(JSON.parse(lt.textContent))})();
