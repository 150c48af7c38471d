(function(){"use strict";const ne=`
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

// Takes a sample through the edit whose numbers begin at a row; true where it was emptied.
bool mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + 3].w > 0.5;
  int resolution_ = int(rows[e + 2].w);
  int first = e + 8;
  if (rows[e + 4].w > 0.5) {
    vec3 y = times(first, p - rows[first + 3].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return false;
    }
    vec3 at = times(e + 3, p - rows[e + 2].xyz);
    if (inBox(at, rows[e + 6].xyz, rows[e + 7].xyz)) interpolate(e, resolution_, at, p, v);
    return false;
  }
  float error;
  if (rows[e].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return false;
    }
  }
  if (rows[e + 1].w < 1.5) return false;
  hexahedron(p, first + 18, error);
  if (!continuous) return error <= EDGE;
  if (error <= EDGE) interpolate(e, resolution_, times(e + 3, p - rows[e + 2].xyz), p, v);
  return false;
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
`,oe=2;function se(r){return r<=oe?r:null}function ae(r){const e=n=>`if (inBox(p, rows[${n}].xyz, rows[${n} + 1].xyz) && mapEdit(${n}, p, v)) return true;`,i=["bool mapSample(inout vec3 p, inout vec3 v) {",...(r===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * ROW")} }`]:Array.from({length:r},(n,o)=>e(`${r-1-o} * ROW`))).map(n=>`  ${n}`),"  return false;","}"];return ne.replace("MAP_SAMPLE",`${i.join(`
`)}
`)}class B extends Error{}function ce(r,e){const t=r.field.brick,i=t+1,n=r.header.resolution.map(d=>Math.ceil((d-1)/t)),o=he(r,n),s=Math.min(255,Math.floor(e/i)),a=Math.min(s,Math.max(1,Math.ceil(Math.cbrt(o.length)))),c=Math.min(s,Math.max(1,Math.ceil(Math.sqrt(o.length/a)))),l=Math.max(1,Math.ceil(o.length/(a*c)));if(l>s)throw new B(`${o.length} bricks do not fit into textures of ${e} texels an edge`);const f=new Uint8Array(4*n[0]*n[1]*n[2]);for(const[d,u]of o.entries())f.set([d%a,Math.floor(d/a)%c,Math.floor(d/(a*c)),255],4*u);const h=Math.ceil(3*r.header.steps.length/4);return{brick:t,edge:i,dims:n,across:[a,c,l],count:o.length,index:f,bricks:o,colours:h}}function le({across:r,edge:e,colours:t,index:i}){return r[0]*r[1]*r[2]*e**3*(2+4*t)+i.length}function he(r,e){const{codes:t,dims:i}=r.occupancy,n=r.field.brick/4,o=new Uint8Array(e[0]*e[1]*e[2]);let s=0;for(let a=0;a<i[0];a++)for(let c=0;c<i[1];c++)for(let l=0;l<i[2];l++,s++)t[s]<256&&(o[(Math.floor(a/n)*e[1]+Math.floor(c/n))*e[2]+Math.floor(l/n)]=1);return Int32Array.from(o.keys()).filter(a=>o[a]===1)}class fe{constructor(e,t){this.level=e,this.layout=t;const{brick:i}=t;this.wire=e.header.resolution.map(a=>Math.ceil(a/i));const n=i**3;this.numbers=new Int32Array(e.bricks.length).fill(-1),this.slots=new Int32Array(e.masks.length/(n/8)*n).fill(-1);let o=0;e.bricks.forEach((a,c)=>{a&&(this.numbers[c]=o++)});let s=0;for(let a=0;a<this.slots.length;a++)e.masks[a>>3]>>(a&7)&1&&(this.slots[a]=s++)}slots;numbers;wire;layer(e){const{across:t,edge:i,count:n,colours:o,bricks:s}=this.layout,a=t[0]*t[1]*i**3,c={density:new Uint16Array(a),colours:Array.from({length:o},()=>new Uint8Array(4*a).fill(128))},l=e*t[0]*t[1],f=new Int32Array(i**3);for(let h=l;h<Math.min(n,l+t[0]*t[1]);h++)this.vertices(s[h],f),this.put(c,h-l,f);return c}vertices(e,t){const{dims:i,brick:n,edge:o}=this.layout,s=[Math.floor(e/(i[1]*i[2])),Math.floor(e/i[2])%i[1],e%i[2]];let a=0;for(let c=0;c<o;c++)for(let l=0;l<o;l++)for(let f=0;f<o;f++,a++){const h=c<n?s[0]:s[0]+1,d=l<n?s[1]:s[1]+1,u=f<n?s[2]:s[2]+1;if(t[a]=-1,h>=this.wire[0]||d>=this.wire[1]||u>=this.wire[2])continue;const m=this.numbers[(h*this.wire[1]+d)*this.wire[2]+u];m>=0&&(t[a]=this.slots[((m*n+c%n)*n+l%n)*n+f%n])}}put(e,t,i){const{across:n,edge:o}=this.layout,{density:s,sh:a,header:c}=this.level,l=n[0]*o,f=l*n[1]*o,h=t%n[0]*o+Math.floor(t/n[0])*o*l,d=3*c.steps.length;let u=0;for(let m=0;m<o;m++)for(let x=0;x<o;x++)for(let p=0;p<o;p++,u++){const w=i[u];if(w<0)continue;const v=h+m*f+x*l+p;e.density[v]=s[w];for(let y=0;y<d;y++)e.colours[y>>2][4*v+(y&3)]=a[y*c.vertices+w]}}}function G(r,e,t){const i=performance.now(),n=r.createProgram();for(const[a,c]of[[r.VERTEX_SHADER,e],[r.FRAGMENT_SHADER,t]]){const l=r.createShader(a);if(l===null)throw new Error("the GPU's context is lost");r.shaderSource(l,c),r.compileShader(l),r.attachShader(n,l),r.deleteShader(l)}if(r.linkProgram(n),!r.getProgramParameter(n,r.LINK_STATUS)&&!r.isContextLost()){const c=(r.getAttachedShaders(n)??[]).map(l=>r.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${r.getProgramInfoLog(n)??""}`)}const o=new Map;return{program:n,uniform:a=>{const c=o.get(a);if(c!==void 0)return c;const l=r.getUniformLocation(n,a);return o.set(a,l),l},milliseconds:performance.now()-i}}function U(r,e,t,i){for(;r.getError()!==r.NO_ERROR;);const n=r.createTexture();if(r.bindTexture(r.TEXTURE_3D,n),r.texStorage3D(r.TEXTURE_3D,1,e,t[0],t[1],t[2]),X(r,r.TEXTURE_3D,i),r.getError()===r.OUT_OF_MEMORY)throw r.deleteTexture(n),new Error("the GPU has not enough memory for the field");return n}function X(r,e,t){r.texParameteri(e,r.TEXTURE_MIN_FILTER,t),r.texParameteri(e,r.TEXTURE_MAG_FILTER,t);for(const i of e===r.TEXTURE_3D?[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T,r.TEXTURE_WRAP_R]:[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(e,i,r.CLAMP_TO_EDGE)}function z(r){r.bindBuffer(r.PIXEL_UNPACK_BUFFER,null),r.pixelStorei(r.UNPACK_ALIGNMENT,1),r.pixelStorei(r.UNPACK_FLIP_Y_WEBGL,!1),r.pixelStorei(r.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),r.pixelStorei(r.UNPACK_COLORSPACE_CONVERSION_WEBGL,r.NONE);for(const e of[r.UNPACK_ROW_LENGTH,r.UNPACK_IMAGE_HEIGHT,r.UNPACK_SKIP_PIXELS,r.UNPACK_SKIP_ROWS,r.UNPACK_SKIP_IMAGES])r.pixelStorei(e,0)}async function de(r,e,t,i){const n=ce(e,r.getParameter(r.MAX_3D_TEXTURE_SIZE)),o=le(n);if(o>t)throw new B(`the field takes ${Math.ceil(o/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);const{across:s,edge:a,dims:c}=n,l=s.map(h=>h*a),f=[];try{const h=U(r,r.R16F,l,r.LINEAR);f.push(h);const d=Array.from({length:n.colours},()=>{const x=U(r,r.RGBA8,l,r.LINEAR);return f.push(x),x}),u=new fe(e,n);for(let x=0;x<s[2];x++){const p=u.layer(x);z(r);const w=(v,y,E,R)=>{r.bindTexture(r.TEXTURE_3D,v),r.texSubImage3D(r.TEXTURE_3D,0,0,0,x*a,l[0],l[1],a,y,E,R)};if(w(h,r.RED,r.HALF_FLOAT,p.density),p.colours.forEach((v,y)=>w(d[y],r.RGBA,r.UNSIGNED_BYTE,v)),r.bindTexture(r.TEXTURE_3D,null),await new Promise(v=>setTimeout(v)),!i())throw new Error("not wanted any more")}z(r);const m=U(r,r.RGBA8UI,[c[2],c[1],c[0]],r.NEAREST);return f.push(m),r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,c[2],c[1],c[0],r.RGBA_INTEGER,r.UNSIGNED_BYTE,n.index),r.bindTexture(r.TEXTURE_3D,null),{layout:n,density:h,colours:d,index:m,bytes:o}}catch(h){for(const d of f)r.deleteTexture(d);if(!i())return null;throw h}}function $(r,{dims:e,codes:t}){z(r);const i=U(r,r.R16UI,[e[2],e[1],e[0]],r.NEAREST);return r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],r.RED_INTEGER,r.UNSIGNED_SHORT,t),r.bindTexture(r.TEXTURE_3D,null),i}function ue(r,e){for(const t of[e.density,e.index,...e.colours])r.deleteTexture(t)}class N{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}held=[];length=0;arrived=0;source;async take(e){for(;this.length<e;){const{value:n,done:o}=await this.source.read();if(o)throw new Error("the file of the field is truncated");this.held.push(n),this.length+=n.length,this.arrived+=n.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let i=0;for(;i<e;){const n=this.held[0],o=n.subarray(0,e-i);t.set(o,i),i+=o.length,o.length===n.length?this.held.shift():this.held[0]=n.subarray(o.length)}return this.length-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function me(r){const e=new Blob([r]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class S{constructor(e,t,i){this.header=e,this.entries=t,this.reader=i}next=0;static async open(e,t,i){const n=await e.take(16),o=new DataView(n.buffer);if(String.fromCharCode(...n.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const s=o.getUint32(8,!0);if(s!==i)throw new Error(`"${t}" of version ${s}, this page reads ${i}; reload it`);const a=new TextDecoder().decode(await e.take(o.getUint32(12,!0))),c=JSON.parse(a);return new S(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const i=await me(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(i);case"u2":return new Uint16Array(i);case"i4":return new Int32Array(i);case"f4":return new Float32Array(i)}}}const xe="cagepage",pe=1;async function*ve(r,e){const t=new N(r,e);try{const i=await S.open(t,xe,pe);for(const[n,o]of i.header.levels.entries()){const s=await i.read(`${n}.bricks`),a=await i.read(`${n}.masks`),c=await i.read(`${n}.occupancy`),l=await i.read(`${n}.density`),f=await i.read(`${n}.sh`);yield{field:i.header,header:o,last:n===i.header.levels.length-1,bricks:s,masks:a,density:O(l),sh:ye(f,o.vertices),occupancy:{origin:[0,0,0],dims:o.dims,codes:c}}}}finally{t.cancel()}}function O(r){const e=r.length/2,t=new Uint16Array(e);for(let i=0;i<e;i++)t[i]=r[i]|r[e+i]<<8;return t}function ye(r,e){for(let t=0;t<r.length;t+=e){let i=128;for(let n=t;n<t+e;n++)r[n]=i=i+r[n]&255}return r}const we=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)"];function Ee(r){const e=Math.ceil(3*r/4),t=[`uniform float coefficientSteps[${r}];`,...Array.from({length:e},(i,n)=>`uniform sampler3D colourAtlas${n};`),"vec3 colourAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(i,n)=>`  vec4 s${n} = 255.0 * textureLod(colourAtlas${n}, at, 0.0) - 128.0;`)];for(let i=0;i<r;i++){const n=[0,1,2].map(o=>`s${3*i+o>>2}.${"xyzw"[3*i+o&3]}`);t.push(`  rgb += (coefficientSteps[${i}] * (${we[i]})) * vec3(${n.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colours:e}}const W=`#version 300 es
void main() {
  vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 0.0, 1.0);
}`,ge=`
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

// The texel, whole where a vertex is, of grid coordinates in the atlas; false where their brick is empty.
bool locate(vec3 g, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 place = texelFetch(brickIndex, b.zyx, 0);
  corner = ivec3(place.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return place.a > 0u;
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
`,Te=`
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
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      bool emptied = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (emptied) alive = false;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, texel, corner)) {
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
`;function be(r,e){const{source:t,colours:i}=Ee(r.K),n=[`#define BRICK ${e}`,`#define COLOURS ${i}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return r.contracted&&n.push("#define CONTRACTED"),r.edited&&n.push("#define EDITED"),r.normals&&n.push("#define NORMALS"),r.count&&n.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...n,ge,t,r.edited?ae(r.edits):"",Te].join(`
`)}class Re{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get colour(){return this.textures?.colour??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={colour:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{colour:i,depth:n,normals:o}=this.textures;for(const[s,a]of[i,n,o].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+s,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:i,height:n}=this,o=new Uint8Array(4*i*n),s=e&&this.textures?.normals?new Uint8Array(4*i*n):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,i,n,t.RGBA,t.UNSIGNED_BYTE,o),s&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,i,n,t.RGBA,t.UNSIGNED_BYTE,s)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=this.readDepth();return{width:i,height:n,rgba:F(o,4*i),depth:a,normals:s&&F(s,4*i)}}readDepth(){const{gl:e,width:t,height:i}=this,n=new Uint32Array(t*i);if(e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.pixelStorei(e.PACK_ALIGNMENT,1),e.readBuffer(e.COLOR_ATTACHMENT1),e.getParameter(e.IMPLEMENTATION_COLOR_READ_FORMAT)===e.RED_INTEGER)e.readPixels(0,0,t,i,e.RED_INTEGER,e.UNSIGNED_INT,n);else{const o=new Uint32Array(4*t*i);e.readPixels(0,0,t,i,e.RGBA_INTEGER,e.UNSIGNED_INT,o);for(let s=0;s<n.length;s++)n[s]=o[4*s]}return e.bindFramebuffer(e.FRAMEBUFFER,null),F(new Float32Array(n.buffer),t)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const i of Object.values(t))e.deleteTexture(i);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e,t){const{gl:i}=this,n=i.createTexture();return i.bindTexture(i.TEXTURE_2D,n),i.texStorage2D(i.TEXTURE_2D,1,e,this.width,this.height),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,t),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MAG_FILTER,t),i.bindTexture(i.TEXTURE_2D,null),n}}function F(r,e){const t=r.length/e;for(let i=0;i<t>>1;i++){const[n,o]=[i*e,(t-1-i)*e],s=r.slice(n,n+e);r.copyWithin(n,o,o+e),r.set(s,o)}return r}const _e=768*2**20,Ae=`#version 300 es
precision highp float;
uniform sampler2D picture;
uniform vec2 size;
out vec4 colour;
void main() { colour = vec4(texture(picture, gl_FragCoord.xy / size).rgb, 1.0); }`;class H{constructor(e,t=_e){this.gl=e,this.memory=t,this.targets=new Re(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;compileTime=0;shown=null;onGpu=null;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shown?.level??null}get active(){return this.edited&&this.shown?.level.last?this.onGpu:null}get bytes(){return this.shown?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const i=++this.loading,n=()=>i===this.loading;let o=0;for await(const s of ve(e,t.onArrival)){if(await this.take(s,n),!n())return;t.onLevel?.(++o,s.field.levels.length)}}async restore(){const{shown:e,onGpu:t}=this;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shown=this.onGpu=null,this.targets.forget();const i=++this.loading;e&&await this.take(e.level,()=>i===this.loading),this.setEdits(t?.edits??null)}setEdits(e){const{gl:t}=this;if(this.onGpu&&(t.deleteBuffer(this.onGpu.buffer),t.deleteTexture(this.onGpu.lattice),t.deleteTexture(this.onGpu.occupancy),this.onGpu=null),e===null||e.edits===0)return;if(e.rows.length>4*1024)throw new Error("more edits than the page's shader holds");const i=t.createBuffer();t.bindBuffer(t.UNIFORM_BUFFER,i),t.bufferData(t.UNIFORM_BUFFER,16*1024,t.STATIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e.rows),t.bindBuffer(t.UNIFORM_BUFFER,null),this.onGpu={edits:e,buffer:i,lattice:this.uploadLattice(e),occupancy:$(t,e.occupancy)}}render(e={}){const{gl:t,shown:i,camera:n,active:o}=this;if(!i||!n||t.isContextLost())return!1;const{level:s,textures:a}=i,{width:c,height:l}=this.targets,f={K:s.header.steps.length,contracted:s.field.contracted,edited:o!==null,edits:o&&se(o.edits.edits),normals:e.normals??!1,count:e.count??!1},{program:h,uniform:d}=this.program(f,s.field.brick);this.targets.bind(f.normals),t.useProgram(h),t.bindVertexArray(this.vertices),this.plainState(),this.setField(d,i),this.setView(d,n);let u=0;const m=(w,v,y)=>{t.activeTexture(t.TEXTURE0+u),t.bindTexture(v,y),t.uniform1i(d(w),u++)};m("densityAtlas",t.TEXTURE_3D,a.density),m("brickIndex",t.TEXTURE_3D,a.index),m("bricks",t.TEXTURE_3D,o?.occupancy??i.occupancy),a.colours.forEach((w,v)=>m(`colourAtlas${v}`,t.TEXTURE_3D,w)),o&&(m("lattice",t.TEXTURE_2D,o.lattice),t.uniform1i(d("editCount"),o.edits.edits),t.uniform1i(d("boxCount"),o.edits.boxes),t.uniform1i(d("preserveOpacity"),Number(o.edits.preserveOpacity)),t.uniformBlockBinding(h,t.getUniformBlockIndex(h,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,o.buffer));const{first:x,count:p}=e.rows??{first:0,count:l};return t.enable(t.SCISSOR_TEST),t.scissor(0,x,c,p),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),this.unbind(),!0}show(e,t,i=null){const{gl:n}=this,o=this.cached("show",()=>G(n,W,Ae));n.bindFramebuffer(n.FRAMEBUFFER,i),n.viewport(0,0,e,t),n.useProgram(o.program),n.bindVertexArray(this.vertices),this.plainState(),n.activeTexture(n.TEXTURE0),n.bindTexture(n.TEXTURE_2D,this.targets.colour),n.uniform1i(o.uniform("picture"),0),n.uniform2f(o.uniform("size"),e,t),n.drawArrays(n.TRIANGLES,0,3),this.unbind()}read(e=!1){return this.targets.read(e)}readDepth(){return this.targets.readDepth()}dispose(){this.loading++,this.setEdits(null),this.drop(),this.targets.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const i=await de(this.gl,e,this.memory,t);i!==null&&(this.drop(),this.shown={level:e,textures:i,occupancy:$(this.gl,e.occupancy)})}drop(){this.shown&&(ue(this.gl,this.shown.textures),this.gl.deleteTexture(this.shown.occupancy),this.shown=null)}uploadLattice({lattice:e}){const{gl:t}=this,i=Math.max(1,Math.ceil(e.length/(3*2048))),n=new Uint16Array(3*2048*i);n.set(e),z(t);const o=t.createTexture();return t.bindTexture(t.TEXTURE_2D,o),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,2048,i),X(t,t.TEXTURE_2D,t.NEAREST),t.texSubImage2D(t.TEXTURE_2D,0,0,0,2048,i,t.RGB,t.HALF_FLOAT,n),t.bindTexture(t.TEXTURE_2D,null),o}program(e,t){return this.cached(JSON.stringify([e,t]),()=>{const i=G(this.gl,W,be(e,t));return this.compileTime=i.milliseconds,i})}cached(e,t){let i=this.programs.get(e);return i||(i=t(),this.programs.set(e,i)),i}setField(e,{level:t,textures:i}){const{gl:n,active:o}=this,{bounds:s,contracted:a}=t.field,{resolution:c,unit:l,steps:f}=t.header,{across:h,edge:d,dims:u}=i.layout,x=s[1].map((E,R)=>E-s[0][R]).map((E,R)=>a?2/E:(c[R]-1)/E),p=s[0].map((E,R)=>a?.5*(E+s[1][R]):E),{origin:w,dims:v}=o?.edits.occupancy??t.occupancy,y=this.step??t.field.step;n.uniform3f(e("atlasScale"),1/(h[0]*d),1/(h[1]*d),1/(h[2]*d)),n.uniform3i(e("indexDims"),...u),n.uniform3i(e("bricksOrigin"),...w),n.uniform3i(e("bricksDims"),...v),n.uniform3i(e("resolution"),...c),n.uniform3fv(e("lower"),p),n.uniform3fv(e("scale"),x),n.uniform3fv(e("halfGrid"),c.map(E=>(E-1)/4)),n.uniform1f(e("unit"),l),n.uniform1f(e("marchStep"),a?y:y/Math.max(...x)),n.uniform1fv(e("coefficientSteps"),f)}setView(e,t){const{gl:i}=this,{width:n,height:o}=this.targets,{c2w:s}=t,a=n/t.width,c=o/t.height;i.uniform3f(e("eye"),s[3],s[7],s[11]),i.uniformMatrix3fv(e("rotation"),!0,[s[0],s[1],s[2],s[4],s[5],s[6],s[8],s[9],s[10]]),i.uniform4f(e("lens"),t.fx*a,t.fy*c,t.cx*a,t.cy*c),i.uniform1f(e("height"),o),i.uniform1f(e("near"),this.near),i.uniform3f(e("background"),...this.background)}plainState(){const{gl:e}=this;for(const t of[e.BLEND,e.DEPTH_TEST,e.CULL_FACE,e.STENCIL_TEST,e.SCISSOR_TEST,e.DITHER])e.disable(t);e.colorMask(!0,!0,!0,!0),e.depthMask(!1)}unbind(){const{gl:e}=this;for(let t=15;t>=0;t--)e.activeTexture(e.TEXTURE0+t),e.bindTexture(e.TEXTURE_2D,null),e.bindTexture(e.TEXTURE_3D,null);e.bindVertexArray(null),e.bindFramebuffer(e.FRAMEBUFFER,null),e.useProgram(null)}}async function q(r){const e=new N(r),{header:t,...i}=await Me(e),n=await i.read("rows"),o=O(await i.read("lattice")),s=await i.read("occupancy");return{edits:t.edits,boxes:t.boxes,preserveOpacity:t.preserve_opacity,rows:n,lattice:o,occupancy:{origin:t.origin,dims:t.dims,codes:s}}}async function Me(r){const e=await S.open(r,"cageedit",1);return{header:e.header,read:t=>e.read(t)}}const V=new Map;function K(r){let e=V.get(r);if(!e){let t;const i=new ReadableStream({start:n=>void(t=n)});if(!t)throw new Error("a stream without a controller");V.set(r,e={stream:i,controller:t})}return e}function Se(r,e){document.currentScript?.remove();const{controller:t}=K(r);try{e===null?t.close():t.enqueue(Ie(e))}catch{}}function Ie(r){const e=atob(r),t=new Uint8Array(e.length);for(let i=0;i<e.length;i++)t[i]=e.charCodeAt(i);return t}async function k(r,{url:e}){if(e===void 0)return K(r).stream;if(location.protocol==="file:")throw new Error("A page may not read files beside it from a disk: open it by a web server (python -m http.server), or export one .html file.");const t=await fetch(e);if(!t.ok||t.body===null)throw new Error(`${e} cannot be loaded (${t.status}); reload the page.`);return t.body}async function De(r){return await new Response(r).arrayBuffer()}const L=[1,.75,.5,.35,.25,.18,.12];class Ue{constructor(e=28,t=40){this.moving=e,this.part=t}cost=null;took(e,t){const i=t/Math.max(1,e);this.cost=this.cost===null?i:this.cost+.3*(i-this.cost)}scale(e,t){const{cost:i}=this;return i===null?.25:L.find(n=>i*e*t*n*n<=this.moving)??L[L.length-1]}rows(e,t){return this.cost===null?16:Math.max(4,Math.min(t,Math.floor(this.part/Math.max(1e-9,this.cost*e))))}}async function ze(r){const e=performance.now(),t=r.fenceSync(r.SYNC_GPU_COMMANDS_COMPLETE,0);if(r.flush(),t===null)return 0;for(;!r.isContextLost()&&r.clientWaitSync(t,0,0)===r.TIMEOUT_EXPIRED;)await new Promise(i=>setTimeout(i,1));return r.deleteSync(t),performance.now()-e}const Y=(r,e)=>Math.hypot(r.x-e.x,r.y-e.y);function Oe(r,e){const t=new Map;let i=!1;const n=()=>{const o=[...t.values()];if(o.length===0)return;const s=o.slice(0,2),a=f=>s.reduce((h,{at:d,from:u})=>h+d[f]-u[f],0)/s.length,[c,l]=[a("x"),a("y")];if(s.length===2||s[0].shifts?(c!==0||l!==0)&&e.shift(c,l):(c!==0||l!==0)&&e.turn(c,l),s.length===2){const[f,h]=[Y(s[0].from,s[1].from),Y(s[0].at,s[1].at)];f>1&&h>1&&f!==h&&e.zoom(f/h)}for(const f of o)f.from=f.at};r.style.touchAction="none",r.addEventListener("contextmenu",o=>o.preventDefault()),r.addEventListener("pointerdown",o=>{r.setPointerCapture(o.pointerId),n();const s={x:o.clientX,y:o.clientY};t.set(o.pointerId,{at:s,from:s,shifts:o.button!==0||o.shiftKey})});for(const o of["pointerup","pointercancel"])r.addEventListener(o,s=>{n(),t.delete(s.pointerId)});r.addEventListener("pointermove",o=>{const s=t.get(o.pointerId);s&&(s.at={x:o.clientX,y:o.clientY},!i&&(i=!0,requestAnimationFrame(()=>{i=!1,n()})))}),r.addEventListener("wheel",o=>{o.preventDefault();const s=o.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;e.zoom(Math.exp(.0012*s*o.deltaY))},{passive:!1})}const g=(r,e,t=1)=>[r[0]+t*e[0],r[1]+t*e[1],r[2]+t*e[2]],T=(r,e)=>g(r,e,-1),C=(r,e)=>[e*r[0],e*r[1],e*r[2]],_=(r,e)=>r[0]*e[0]+r[1]*e[1]+r[2]*e[2],I=(r,e)=>[r[1]*e[2]-r[2]*e[1],r[2]*e[0]-r[0]*e[2],r[0]*e[1]-r[1]*e[0]],j=r=>Math.hypot(...r),A=r=>C(r,1/Math.max(1e-30,j(r)));function J(r,e,t){const[i,n]=[Math.cos(t),Math.sin(t)];return g(g(C(r,i),I(e,r),n),e,_(e,r)*(1-i))}const b=(r,e)=>[r[e],r[4+e],r[8+e]];function Z(r,e,t,i){return[0,1,2].flatMap(n=>[r[n],e[n],t[n],i[n]]).concat(0,0,0,1)}const Q=.02;class ee{constructor(e,t,i){this.up=t,this.eye=b(e,3);const n=C(b(e,2),-1);this.target=g(this.eye,n,Math.max(_(T(i,this.eye),n),.001))}eye;target;get c2w(){const e=A(T(this.eye,this.target)),t=A(I(this.up,e));return Z(t,I(e,t),e,this.eye)}turn(e,t){const i=J(T(this.eye,this.target),this.up,-e),n=A(I(this.up,i)),o=Math.acos(Math.max(-1,Math.min(1,_(A(i),this.up)))),s=Math.max(Q,Math.min(Math.PI-Q,o-t))-o;this.eye=g(this.target,J(i,n,s))}shift(e,t,i){const n=2*i*j(T(this.eye,this.target)),{c2w:o}=this,s=g(C(b(o,0),-e*n),b(o,1),t*n);this.eye=g(this.eye,s),this.target=g(this.target,s)}zoom(e){this.eye=g(this.target,T(this.eye,this.target),e)}}function Ce({stills:r,seconds:e,loop:t},i){const n=e>0?i/e:1,o=r.length-1,s=t?n%1*r.length:Math.min(n,1)*o,a=r[Math.min(Math.floor(s),o)],c=r[t?(Math.floor(s)+1)%r.length:Math.min(Math.floor(s)+1,o)],l=s-Math.floor(s),f=m=>g(b(a.c2w,m),T(b(c.c2w,m),b(a.c2w,m)),l),h=A(f(2)),d=f(1),u=A(T(d,[h[0]*_(d,h),h[1]*_(d,h),h[2]*_(d,h)]));return{c2w:Z(I(u,h),u,h,f(3)),fov_y_deg:a.fov_y_deg+l*(c.fov_y_deg-a.fov_y_deg)}}let D=null;function Ne(){if(D)return D;D=new Float32Array(65536);for(let r=0;r<65536;r++){const e=r>>10&31,t=r&1023,i=e===0?t*2**-24:(1+t/1024)*2**(e-15);D[r]=r&32768?-i:i}return D}const te=new Float32Array(1),re=new Uint32Array(te.buffer);function Fe(r){te[0]=r;const e=re[0]>>>16&32768,t=re[0]&2147483647;return t>=947912704?e|t-939524096+4095+(t>>>13&1)>>>13:e|Math.round(Math.abs(r)*2**24)}function ke(r,e,t){const i=Ne(),n=new Uint16Array(r.length);for(let o=0;o<n.length;o++){const s=i[r[o]];n[o]=Fe(s+t*(i[e[o]]-s))}return n}const Le=[0,12,30];class P{constructor(e,t,i,n,o,s){this.header=e,this.times=t,this.order=i,this.occupancy=n,this.lattice=o,this.states=s}static async read(e){const t=await S.open(new N(e),"cagepath",1),{header:i}=t,n=await t.read("times"),o=await t.read("states"),s=await t.read("occupancy"),a=O(await t.read("lattice")),c=[],l=[];for(const h of i.edits.keys())c.push(await t.read(`rows.${h}`));for(let h=0;h<i.lattices;h++)l.push(O(await t.read(`nodes.${h}`)));const f=i.edits.map((h,d)=>({edits:h,boxes:i.boxes[d],rows:c[d],nodes:i.nodes[d].map(u=>l[u])}));return new P(i,n,o,{origin:i.origin,dims:i.dims,codes:s},a,f)}at(e){const{times:t,order:i,states:n}=this,o=t.length-1;let s=0;for(;s<o-1&&t[s+1]<=e;)s++;const a=Math.max(0,Math.min(1,(e-t[s])/Math.max(1e-9,t[s+1]-t[s]))),c=n[i[s]],l=n[i[s+1]],f=a<.5?c:l;if(c===l||!Pe(c,l))return this.edits(f,f.rows,f.nodes);const h=c.nodes.map((d,u)=>d===l.nodes[u]?d:ke(d,l.nodes[u],a));return this.edits(c,Be(c,l,a),h)}edits({edits:e,boxes:t},i,n){const o=this.lattice.slice();return n.forEach((s,a)=>o.set(s,3*this.header.moving[a][0])),{edits:e,boxes:t,preserveOpacity:this.header.preserve_opacity,rows:i,lattice:o,occupancy:this.occupancy}}}function Pe(r,e){if(r.edits!==e.edits||r.boxes!==e.boxes)return!1;for(let t=3;t<r.rows.length;t+=4)if(r.rows[t]!==e.rows[t])return!1;return!0}function Be({edits:r,boxes:e,rows:t},{rows:i},n){const o=t.map((a,c)=>a+n*(i[c]-a)),s=a=>{for(let c=4*a;c<4*a+3;c++)o[c]=Math.min(t[c],i[c]);for(let c=4*a+4;c<4*a+7;c++)o[c]=Math.max(t[c],i[c])};for(let a=0;a<r;a++)for(const c of Le)s(a*44+c);for(let a=0;a<e;a++)s(r*44+2*a);return o}const Ge=120,Xe=2;class $e{constructor(e,t,i,n=()=>{}){this.canvas=e,this.header=t,this.say=i,this.arrived=n;const o=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!o)throw new Error("This browser has no WebGL2, which the scene is drawn with.");this.gl=o,this.renderer=new H(o),this.renderer.background=t.background??[1,1,1],this.orbit=new ee(t.start.c2w,t.up,t.centre),this.fov=t.start.fov_y_deg,Oe(e,{turn:(s,a)=>this.change(()=>this.orbit.turn(Math.PI*s/e.clientHeight,Math.PI*a/e.clientHeight)),shift:(s,a)=>this.change(()=>this.orbit.shift(s/e.clientHeight,a/e.clientHeight,this.tangent)),zoom:s=>this.change(()=>this.orbit.zoom(s))}),e.addEventListener("webglcontextlost",s=>s.preventDefault()),e.addEventListener("webglcontextrestored",()=>void this.renderer.restore().then(()=>this.touch())),new ResizeObserver(()=>this.touch()).observe(e)}renderer;orbit;gl;pacing=new Ue;fov;moved=performance.now();row=0;sketched=!1;pictures=0;playing=null;edits;along=null;canPlay=!1;async run(){const{files:e}=this.header;this.draw();const t=await k("field",e.field);let i;await this.renderer.load(t,{onArrival:n=>this.arrived(Math.min(.99,n/e.field.bytes)),onLevel:(n,o)=>{this.say(n<o?"Loading detail …":""),i??=this.loadEdits(),this.touch()}}),await i,e.path&&(this.along=await P.read(await k("path",e.path))),this.canPlay=this.header.path!==null,this.arrived(1)}async loadEdits(){const{files:e}=this.header;this.edits=e.edits?await q(await De(await k("edits",e.edits))):null,this.renderer.setEdits(this.edits),this.touch()}get whole(){return this.row===null}get edited(){return this.renderer.edited}set edited(e){this.renderer.edited=e,this.touch()}get plays(){return this.playing!==null}play(e){this.playing=e&&this.canPlay?performance.now():null,this.touch()}home(){this.playing=null,this.edits!==void 0&&this.renderer.setEdits(this.edits),this.look(this.header.start)}seek(e,t){const i=e.loop?t%e.seconds:Math.min(t,e.seconds);this.along&&this.renderer.setEdits(this.along.at(i)),this.look(Ce(e,i))}get tangent(){return Math.tan(this.fov*Math.PI/360)}look(e){this.orbit=new ee(e.c2w,this.header.up,this.header.centre),this.fov=e.fov_y_deg,this.touch()}change(e){this.playing=null,e(),this.touch()}touch(){this.moved=performance.now(),this.row=0,this.sketched=!1}async draw(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{await this.frame()}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}async frame(){const{canvas:e,gl:t,renderer:i,pacing:n}=this,{path:o}=this.header;if(this.playing!==null&&o){const p=(performance.now()-this.playing)/1e3;this.seek(o,p),!o.loop&&p>=o.seconds&&(this.playing=null)}if(this.row===null||i.level?.last&&this.edits===void 0)return;const s=Math.min(devicePixelRatio,Xe),[a,c]=[e.clientWidth,e.clientHeight].map(p=>Math.max(1,Math.round(p*s)));(e.width!==a||e.height!==c)&&Object.assign(e,{width:a,height:c});const l=n.scale(a,c),f=this.sketched&&performance.now()-this.moved>Ge||l===1,h=f?[a,c]:[a,c].map(p=>Math.max(8,Math.round(p*l)));this.aim(h[0],h[1]);const d=f?this.row:0,u=f?Math.min(n.rows(a,c),c-d):h[1],m=this.moved;if(!i.render({rows:{first:d,count:u}}))return;const x=d+u>=h[1];x&&(i.show(a,c),this.pictures++),n.took(h[0]*u,await ze(t)),this.moved===m&&(this.sketched=!0,f&&(this.row=x?null:d+u))}aim(e,t){const i=.5*Math.min(e,t)/this.tangent;this.renderer.setSize(e,t),this.renderer.setCamera({c2w:this.orbit.c2w,width:e,height:t,fx:i,fy:i,cx:e/2,cy:t/2})}}window.cagefieldViewer={FieldRenderer:H,readEdits:q,take:Se};function M(r){const e=document.querySelector(r);if(!e)throw new Error(`the page has no ${r}`);return e}async function We(r){const e=M(".message"),t=M(".arrived"),i=n=>void(e.textContent=n);try{const n=new $e(M("canvas"),r,i,c=>{t.value=c,t.hidden=c>=1});window.cagefieldViewer.viewer=n;const[o,s,a]=[M(".compare"),M(".play"),M(".home")];o.hidden=!r.files.edits,o.onclick=()=>n.edited=!n.edited,s.onclick=()=>n.play(!n.plays),a.onclick=()=>n.home(),setInterval(()=>{s.hidden=!n.canPlay,s.textContent=n.plays?"Stop":"Play",o.textContent=n.edited?"Show before":"Show after"},100),window.addEventListener("keydown",({key:c,target:l})=>{c==="b"&&o.click(),c===" "&&!(l instanceof HTMLButtonElement)&&s.click(),c==="h"&&a.click()}),await n.run()}catch(n){t.hidden=!0,i(n instanceof Error?n.message:String(n))}}const ie=document.getElementById("scene");ie&&We(JSON.parse(ie.textContent))})();
